"""Every scene of the page on effects and materials runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from solidsph import Scene, Simulation
from solidsph.registry import registry
from solidsph.run.energy import kinetic_energy

TEXT = (Path(__file__).parents[2] / "docs/effects.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## ([\w-]+)\n(.*?)(?=^## |\Z)", TEXT, re.DOTALL | re.MULTILINE))


SECTIONS.pop("Sleep")  # no part: it has tests of its own


def example(name: str) -> Scene:
    (text,) = re.findall(r"```toml\n(.*?)```", SECTIONS[name], re.DOTALL)
    return Scene.from_toml(text)


@pytest.mark.parametrize("name", SECTIONS)
def test_the_scene_names_what_it_shows_and_runs(name: str) -> None:
    simulation = Simulation.builder(example(name)).build()
    assert name in {entry.name for entry in simulation.parts}
    state = simulation.run().state
    assert state.step > 5
    assert np.isfinite(state.positions).all()
    assert kinetic_energy(simulation.dynamics.observe(state)) > 0.0


def test_every_effect_has_its_section() -> None:
    elsewhere = {"hourglass-control"}  # which has a page of its own
    assert set(registry.names("effects")) - elsewhere <= set(SECTIONS)
