"""Hard scenes as a user writes them: shape, spacing, material, loads and holds."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph import Simulation
from solidsph.registry import registry
from solidsph.scene.scene import Scene
from solidsph_cases.buckling_strip import BucklingStrip
from solidsph_cases.graded_points import GradedPoints
from solidsph_cases.inflated_ring import RUBBER, pressure_inside, pressure_that_stretches

NAMES = (
    *("notched-sheet", "inflated-ring", "sharp-punch", "closing-hole", "buckling-strip"),
    *("ball-on-corner", "folding-strip", "graded-points"),
)


@pytest.mark.parametrize("name", NAMES)
def test_its_scenes_name_nothing_of_the_scheme(name: str) -> None:
    for scene in registry.load("cases", name)().scenes().values():
        bare = Scene(bodies=scene.bodies, duration=scene.duration)
        for word in ("scheme", "kernel", "cover", "formulation", "integrator", "engine"):
            assert getattr(scene, word) == getattr(bare, word), word
        assert "hourglass-control" not in [effect.part["type"] for effect in scene.effects]
        if name != "graded-points":  # whose points are what it studies
            assert all(body.discretisation is None for body in scene.bodies.values())


@pytest.mark.parametrize("ratio", [1.1, 1.5, 2.0, 4.0])
def test_the_ring_is_the_incompressible_one_but_for_its_compressibility(ratio: float) -> None:
    """Shooting through the compressible ring, against the closed form of the other: mu / kappa is
    1/50. Both solve the same balance in other ways."""
    closed = pressure_that_stretches(ratio) * RUBBER.lame_parameters[1]
    assert pressure_inside(ratio) == pytest.approx(closed, rel=0.03)
    assert pressure_inside(ratio) != pytest.approx(closed, rel=1e-4)


def test_no_ring_holds_more_than_its_limit_load() -> None:
    rising = [pressure_that_stretches(ratio) for ratio in (1.0, 2.0, 8.0, 1e4)]
    assert rising[0] == 0.0
    assert np.all(np.diff(rising) > 0.0)
    assert rising[-1] == pytest.approx(np.log(2.0), rel=1e-6)


def test_the_elastica_begins_at_eulers_load() -> None:
    """At small shortening the force is 4 pi^2 E I / length^2 and the strip a cosine of the
    amplitude that takes up the shortening, (2 / pi) sqrt(e)."""
    strip = BucklingStrip(shortening=1e-3, slenderness=1e4)
    force, way = strip.elastica()
    plate = 1e6 / (1.0 - 0.3**2)
    assert force == pytest.approx(4.0 * np.pi**2 * plate * strip.thickness**3 / 12.0, rel=1e-3)
    assert way == pytest.approx(2.0 / np.pi * np.sqrt(1e-3), rel=1e-3)


def test_points_are_graded() -> None:
    steps = np.diff(GradedPoints().graded(2.0, 30))
    assert steps.sum() == pytest.approx(2.0)
    assert np.all(np.diff(steps) > 0.0)
    assert steps[-1] / steps[0] == pytest.approx(4.0, rel=0.05)


def test_an_unstable_equilibrium_is_told() -> None:
    """Without a push the strip stays straight, beyond eighteen times Euler's load."""
    for push, told in ((0.0, True), (5.0, False)):
        (scene,) = BucklingStrip(across=3, push=push).scenes().values()
        notes = Simulation.builder(scene).build().run().notes
        assert any("the equilibrium is unstable" in note for note in notes) == told
