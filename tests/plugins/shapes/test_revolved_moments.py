"""Exact moments of revolved shapes."""

from __future__ import annotations

from math import pi, radians

import numpy as np
import pytest

from solidsph.interfaces.shape import Moments
from solidsph.registry.construct import construct

CONE = {"type": "polygon", "vertices": [[-1.0, 0.0], [1.0, 0.0], [0.0, 2.0]]}
TUBE = {"type": "box", "lengths": [0.5, 2.0], "origin": [1.0, -1.0]}
PLATE = {"type": "polygon", "vertices": [[0.2, 0.1], [1.1, 0.3], [0.9, 1.4], [0.6, 0.5]]}
WITH_HOLE = {
    "type": "outline",
    "rings": [
        [[0.2, 0.0], [1.2, 0.0], [1.2, 1.0], [0.2, 1.0]],
        [[0.5, 0.4], [0.9, 0.4], [0.9, 0.8], [0.5, 0.8]],
    ],
}
ABOUT = np.array([0.3, -0.2, 0.7])


def moments(profile: object, angle: float = 360.0, about: object = (0.0, 0.0, 0.0)) -> Moments:
    shape = construct("shapes", {"type": "revolved", "of": profile, "angle": angle})
    found = shape.moments(np.array(about))
    assert found is not None
    assert shape.volume() == pytest.approx(found.volume, rel=1e-14)  # rounding
    return found


def by_cells(profile: object, angle: float, about: np.ndarray, count: int) -> Moments:
    """The same by the midpoint rule over the angle and over cells of the profile."""
    shape = construct("shapes", profile)
    lower, upper = shape.bounds()
    step = (upper - lower) / count
    r, z = (low + (np.arange(count) + 0.5) * h for low, h in zip(lower, step, strict=True))
    grid = np.stack(np.meshgrid(r, z, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[(shape.signed_distance(grid) < 0.0) & (grid[:, 0] > 0.0)]
    turn = radians(angle) / 90
    angles = (np.arange(90) + 0.5) * turn
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    x = np.concatenate([grid[:, :1] * way for way in ways])
    x = np.column_stack([x, np.tile(grid[:, 1], 90)]) - about
    V = np.tile(grid[:, 0], 90) * turn * step.prod()
    return Moments(float(V.sum()), V @ x, np.einsum("p,pi,pj->ij", V, x, x))


def test_a_cone_and_a_tube_have_those_of_books() -> None:
    cone = moments(CONE)  # of radius 1 and height 2, on its base
    V = 2.0 * pi / 3.0
    assert cone.volume == pytest.approx(V)
    assert cone.first == pytest.approx([0.0, 0.0, V * 0.5], abs=1e-14)  # a quarter of the height
    # 3/20 of the radius squared, and h^2 (3/80 + 1/16) from the base.
    expected = np.diag([0.15, 0.15, 4.0 * (3.0 / 80.0 + 1.0 / 16.0)]) * V
    assert cone.second == pytest.approx(expected, abs=1e-14)
    tube = moments(TUBE)
    V = pi * (1.5**2 - 1.0**2) * 2.0
    assert tube.volume == pytest.approx(V)
    squares = (1.5**2 + 1.0) / 4.0
    assert tube.second == pytest.approx(np.diag([squares, squares, 1.0 / 3.0]) * V, abs=1e-13)


@pytest.mark.parametrize("profile", [CONE, TUBE, PLATE, WITH_HOLE], ids=lambda p: p["type"])
@pytest.mark.parametrize("angle", [360.0, 250.0, 70.0])
def test_any_angle_about_any_point(profile: object, angle: float) -> None:
    exact = moments(profile, angle, ABOUT)
    near = by_cells(profile, angle, ABOUT, 200)
    # Cells of 1/200 of the profile leave about that of its area at the outline, mostly cancelled.
    scale = float(np.trace(exact.second))
    assert near.volume == pytest.approx(exact.volume, rel=5e-3)
    assert near.first == pytest.approx(exact.first, abs=5e-3 * exact.volume)
    assert near.second == pytest.approx(exact.second, abs=5e-3 * scale)
