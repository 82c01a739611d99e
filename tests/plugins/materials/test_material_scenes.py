"""The example scenes of materials in the documentation, and the Taylor bar."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from solidsph import Record, Scene, Simulation
from solidsph.run.energy import DISSIPATED, KINETIC, RESIDUAL, STRAIN
from solidsph.studies.case_run import run_case
from solidsph.studies.variant import with_settings
from solidsph_cases.taylor_bar import LENGTH, RADIUS, TaylorBar

PAGE = Path(__file__).parents[3] / "docs/effects.md"
MATERIALS = ("j2-plasticity", "johnson-cook", "mooney-rivlin", "holzapfel-ogden")


def documented(name: str) -> Scene:
    section = PAGE.read_text().split(f"\n## {name}\n")[1].split("\n## ")[0]
    return Scene.from_toml(section.split("```toml\n")[1].split("```")[0])


@pytest.mark.parametrize("name", MATERIALS)
def test_the_documented_scene_runs_and_its_ledger_closes(name: str, tmp_path: Path) -> None:
    builder = Simulation.builder(documented(name)).engine("matrix")
    builder.build().run(record=tmp_path / "record.h5")
    with Record(tmp_path / "record.h5") as record:
        history = record.history
        play = np.max(
            history[KINETIC] + history[STRAIN] + history.get(DISSIPATED, 0.0 * history[KINETIC])
        )
        assert play > 0.0
        # The square of the step, at half of the CFL step, where the fastest motion is resolved by
        # a few dozen steps.
        assert np.abs(history[RESIDUAL]).max() < 0.01 * play
        if DISSIPATED in history:
            assert record.field("plastic strain")[-1].max() > 0.05
            assert history[DISSIPATED][-1] > 0.5 * play
        if name == "johnson-cook":
            assert record.field("temperature")[-1].max() > 300.0


def test_the_end_of_a_taylor_bar_does_not_yet_know_of_the_wall(tmp_path: Path) -> None:
    """Before the fastest wave is there it flies on, while the foot flows."""
    outcome = run_case(
        with_settings(TaylorBar(across=2, duration=5e-6), {"engine": "matrix"}), tmp_path
    )
    assert outcome.passed
    with Record(outcome.runs[0].record) as record:
        case = TaylorBar(across=2)
        # The wave is 2 / 3 of the way up; what runs ahead of it by the scheme is small.
        assert case.lengths(record)[-1] == pytest.approx(LENGTH - 227.0 * 5e-6, rel=1e-5)
        assert case.rim_radii(record)[-1].mean() > 1.15 * RADIUS
        # Without friction nothing pushes it sideways: rounding of 240 J over its mass.
        particles = record.particles
        drift = particles.volumes @ (record.positions[-1] - particles.positions)[:, :2]
        assert np.abs(drift / particles.volumes.sum()).max() < 1e-13 * LENGTH
        foot = particles.tags["base"]
        assert np.array_equal(record.positions[-1][foot, 2], particles.positions[foot, 2])
    (picture,) = outcome.pictures
    assert picture.stat().st_size > 20_000
    by_name = {m.quantity: m for m in outcome.measurements}
    assert by_name["final length"].reference is None  # nothing is published of 5 us


@pytest.mark.validation
def test_a_taylor_bar_is_within_what_is_published_and_converges(tmp_path: Path) -> None:
    off = []
    for across in (3, 4):
        outcome = run_case(TaylorBar(across=across, tolerance=0.02), tmp_path)
        for m in outcome.measurements:
            print(f"taylor-bar, {across} along the radius: {m.quantity} = {m.value:.5g} {m.unit}")
        print(outcome.runs[0])
        assert outcome.passed
        by_name = {m.quantity: m for m in outcome.measurements}
        off.append([by_name[name].value for name in ("final length", "foot radius, mean")])
    lengths, radii = np.array(off).T
    # Without any tolerance it is inside both ranges.
    assert 21.4 <= lengths[-1] <= 21.5
    assert 7.0 <= radii[-1] <= 7.2
    # The coarser, the less it flows: shorter and wider at every refinement.
    assert np.all(np.diff(lengths) < 0.0)
    assert np.all(np.diff(radii) > 0.0)
