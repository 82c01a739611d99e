"""The engine of docs/first-engine.md: its own module and one entry point, no change of the core."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph import BuildError, Scene, Simulation
from solidsph.costs.count import count_work
from solidsph.costs.estimate import estimate_work
from solidsph.interfaces.plan import SumMethod
from solidsph.registry import registry
from tests.helpers.guides import Guide
from tests.helpers.scenes import box


@pytest.fixture
def dense(foreign) -> None:
    Guide.read("first-engine").install(foreign)


def scene(engine: str) -> Simulation:
    return (
        box(2, 6)
        .boundary("clamp", where="left")
        .effect("hourglass-control")
        .initial(velocity={"y": "X"})
        .engine(engine)
        .build()
    )


def test_it_is_listed_and_named_by_a_scene(dense: None) -> None:
    assert "dense" in registry.names("engines")
    text = scene("dense").scene.to_toml()
    assert 'engine = "dense"' in text
    assert Scene.from_toml(text).engine == "dense"


def test_it_runs_the_scene_as_the_reference_does(dense: None) -> None:
    """To rounding: the sums are the same, in another order."""
    own, reference = (scene(name).run().state.positions for name in ("dense", "matrix"))
    assert np.abs(own - reference).max() < 1e-12 * np.ptp(reference)


def test_its_plan_is_what_costs_read(dense: None) -> None:
    simulation = scene("dense")
    work, n = count_work(simulation), simulation.particles.count
    assert work.operations[0].method is SumMethod.UNKNOWN
    assert work.operations[0].pairs == n * n
    assert not simulation.plan.compiles_steps
    assert estimate_work(simulation.scene).operations[0].method is SumMethod.UNKNOWN
    (entry,) = [one for one in simulation.parts if one.kind == "engines"]
    assert entry.distribution == "guide-dense"


def test_a_name_that_no_engine_has(dense: None) -> None:
    with pytest.raises(BuildError, match=r"engine 'dens'.*'dense'"):
        Simulation.builder(scene("dense").scene).engine("dens").build()
