"""Bodies in one place: found by their shapes, however little of a particle overlaps."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, Simulation
from solidsph.interfaces.shape import Shape
from solidsph.registry.construct import construct
from solidsph.scene.overlap import overlap
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SOFT

S = 0.05  # spacing [m]
LEAST = 0.05 * S


def shape(kind: str, **parameters: Any) -> Shape:
    made: Shape = construct("shapes", {"type": kind, **parameters})
    return made


def block(x: float, y: float, *lengths: float) -> Shape:
    return shape("box", lengths=list(lengths or (0.2, 0.2)), origin=[x, y])


def turned(x: float, y: float, angle: float = 0.5) -> Shape:
    """A unit square at (x, y), turned together with these coordinates about the origin."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    corners += [x, y]
    turn = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    return shape("polygon", vertices=(corners @ turn.T).tolist())


NOTCHED = {
    "of": {"type": "box", "lengths": [1.0, 1.0]},
    "minus": {"type": "box", "lengths": [0.5, 0.5], "origin": [0.5, 0.5]},
}
RING = shape("annulus", inner_radius=0.5, outer_radius=1.0)
AWAY = 1.0 / 2.0**0.5


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(
    ("one", "other"),
    [
        (block(0, 0), block(0.2, 0)),
        (block(0, 0), block(0.2, 0.1)),  # beside each other by a half
        (block(0, 0), block(0.2, 0.2)),  # corner at corner
        (block(0, 0), block(0.2 - 0.04 * S, 0)),  # less than the tolerance
        (turned(0, 0), turned(1.0, 0.3)),
        (RING, shape("disc", radius=0.5)),  # a pin that fills its hole
        (RING, shape("disc", radius=0.2, centre=[0.1, 0.0])),  # and one that does not
        (shape("disc", radius=0.5), shape("disc", radius=0.5, centre=[AWAY, AWAY])),
        (shape("disc", radius=0.5), block(0.5, -0.1)),
        # A block that fills a notch and stands out of it: where it does, the distance of the
        # notched body is only known to be no less than that of the notch.
        (shape("difference", **NOTCHED), block(0.5, 0.5, 1.5, 0.8)),
        (shape("interval", length=1.0), shape("interval", length=1.0, origin=1.0)),
        (
            shape("ball", radius=0.5),
            shape("box", lengths=[1.0] * 3, origin=[-0.5, -0.5, 0.5]),
        ),
    ],
)
def test_bodies_that_touch_do_not_overlap(one: Shape, other: Shape, order: int) -> None:
    assert overlap(*(one, other)[::order], LEAST) is None


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(
    ("one", "other", "depth"),
    [
        (block(0, 0), block(0.18, 0), 0.02),  # 0.4 spacings
        (block(0, 0), block(0.2 - 0.06 * S, 0), 0.06 * S),
        (block(0, 0), block(0.19, 0.19), 0.01),  # only the corners
        (block(0, 0), block(0.05, 0.05, 0.1, 0.1), 0.1),  # one inside the other
        (block(0, 0.45, 1.0, 0.1), block(0.45, 0, 0.1, 1.0), 0.1),  # no corner inside the other
        (turned(0, 0), turned(0.99, 0.3), 0.01),
        (RING, shape("disc", radius=0.51), 0.01),  # a press fit all around
        (RING, shape("disc", radius=0.2, centre=[0.31, 0.0]), 0.01),  # beside its hole
        (
            shape("disc", radius=0.5),
            shape("disc", radius=0.5, centre=[0.99 * AWAY, 0.99 * AWAY]),
            0.01,
        ),
        (shape("disc", radius=0.5), block(0.49, -0.1), 0.01),
        (shape("difference", **NOTCHED), block(0.49, 0.5, 1.5, 0.8), 0.01),
        (shape("interval", length=1.0), shape("interval", length=1.0, origin=0.99), 0.01),
        (
            shape("ball", radius=0.5),
            shape("box", lengths=[1.0] * 3, origin=[-0.5, -0.5, 0.49]),
            0.01,
        ),
    ],
)
def test_the_depth_is_that_of_the_largest_ball_in_both(
    one: Shape, other: Shape, depth: float, order: int
) -> None:
    found = overlap(*(one, other)[::order], LEAST)
    assert found is not None
    # Cells end at two tolerances; how deep a corner reaches is known to about one of them.
    assert found.depth == pytest.approx(depth, abs=0.5 * LEAST)
    assert max(s.signed_distance(found.place[None])[0] for s in (one, other)) < 0.0


def scene(*origins: float, spacing: float = S) -> SceneBuilder:
    builder = (
        Simulation.builder()
        .kernel("cubic-spline", cover=2.2)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian")
        .duration(1e-3)
    )
    for k, x in enumerate(origins):
        builder.body(
            f"b{k}",
            shape={"type": "box", "lengths": [0.2, 0.2], "origin": [x, 0.0]},
            spacing=spacing if k else S,
        )
    return builder


@pytest.mark.parametrize("effect", ["", "contact", "joint"])
@pytest.mark.parametrize("spacing", [S, 0.5 * S])
def test_bodies_in_one_place_are_refused_with_the_overlap(effect: str, spacing: float) -> None:
    builder = scene(0.0, 0.18, spacing=spacing)
    if effect:
        builder.effect(effect)
    with pytest.raises(BuildError, match=r"'b0' and 'b1' are in one place.*0\.02 m"):
        builder.build()


def test_each_pair_is_told_once() -> None:
    with pytest.raises(BuildError) as refused:
        scene(0.0, 0.19, 0.38).build()
    assert len(refused.value.problems) == 2
    assert "'b0' and 'b1'" in refused.value.problems[0]
    assert "'b1' and 'b2'" in refused.value.problems[1]
    scene(0.0, 0.2, 0.4).build()


def test_many_edges_that_touch() -> None:
    """A pin in its hole, both of 200 edges: they share a surface and no more."""
    angles = np.linspace(0.0, 2.0 * pi, 201)[:-1]
    round_ = [[0.5 * cos(q), 0.5 * sin(q)] for q in angles]
    hole = {"of": {"type": "disc", "radius": 1.0}, "minus": {"type": "polygon", "vertices": round_}}
    pin = shape("polygon", vertices=round_)
    assert overlap(shape("difference", **hole), pin, LEAST) is None
