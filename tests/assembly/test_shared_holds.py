"""Motions that agree where their faces meet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, Simulation
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SOFT

PRESS = {"x": 0, "y": "-0.1*sin(2*t)"}


def quarter(foot: str, head: str, *, motion: Any = PRESS, engine: str = "matrix") -> SceneBuilder:
    """A block on a rough foot under a rough head, of which the left side is a plane of symmetry."""
    return (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [1.0, 1.0]}, spacing=0.2)
        .material("neo-hookean", **SOFT)
        .boundary("symmetry", axis="x")
        .boundary("clamp", where=foot, label="foot")
        .boundary("prescribed-motion", where=head, displacement=motion, label="head")
        .engine(engine)
        .duration(0.02)
    )


@pytest.mark.parametrize(
    "engine", ["matrix", pytest.param("compiled", marks=pytest.mark.validation)]
)
def test_two_faces_may_hold_their_edge(engine: str) -> None:
    """It moves as by hand: the edges belong to the plane along x, and to foot and head along y."""
    simulation = quarter("bottom", "top", engine=engine).build()
    state = simulation.run().state
    X = simulation.particles.positions
    by_hand = (
        quarter("bottom and X > 0.1", "top and X > 0.1", engine=engine)
        .boundary("clamp", where="bottom and X < 0.1", axes=["y"], label="corner")
        .boundary(
            "prescribed-motion",
            where="top and X < 0.1",
            displacement={"y": PRESS["y"]},
            label="upper",
        )
    )
    expected = by_hand.build().run().state
    largest = np.abs(expected.positions - X).max()
    assert np.abs(state.positions - expected.positions).max() < 1e-12 * largest
    corner = (X[:, 0] == 0.0) & (X[:, 1] == 0.0)
    # Its reaction is in one account only.
    assert state.applied["symmetry"][corner, 0] != 0.0
    assert state.applied["foot"][corner, 0] == 0.0
    assert state.applied["foot"][corner, 1] != 0.0


@pytest.mark.parametrize("motion", [{"x": 0.01, "y": 0}, {"x": "0.1*t", "y": 0}])
def test_motions_that_differ_are_refused(motion: Any) -> None:
    with pytest.raises(BuildError, match="'head' and 'symmetry' both determine the motion of 1"):
        quarter("bottom", "top", motion=motion).build()


def test_a_motion_that_is_named_twice_is_refused() -> None:
    with pytest.raises(BuildError, match="both determine the motion of 6 particles"):
        quarter("bottom", "bottom", motion={"x": 0, "y": 0}).build()
