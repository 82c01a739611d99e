"""Outlines of many edges, unions of many shapes."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.errors import SceneError
from solidsph.registry.construct import construct
from solidsph_builtin.shapes import _outline


def test_the_distance_of_an_outline_is_that_of_its_nearest_edge() -> None:
    # A star with long and short edges and reflex corners, edge by edge.
    angles = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    radii = np.where(np.arange(240) % 40 == 0, 3.0, 1.0 + 0.2 * np.sin(9.0 * angles))
    corners = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    polygon = construct("shapes", {"type": "polygon", "vertices": corners.tolist()})
    points = np.random.default_rng(5).uniform(-3.5, 3.5, (2000, 2))
    least, crossings = np.full(len(points), np.inf), np.zeros(len(points), dtype=int)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        gaps = points - a - along[:, None] * (b - a)
        least = np.minimum(least, np.hypot(*gaps.T))
        spans = (points[:, 1] < a[1]) != (points[:, 1] < b[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            meets = a[0] + (points[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        crossings += spans & (points[:, 0] < meets)
    right = np.where(crossings % 2 == 1, -least, least)
    # Rounding of coordinates of 3.5, a few times over.
    assert np.abs(polygon.signed_distance(points) - right).max() < 1e-14


def test_the_distance_of_a_union_of_many_is_that_of_the_nearest_part() -> None:
    centres = np.stack(np.meshgrid(np.arange(8.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    radii = 0.2 + 0.5 * np.random.default_rng(1).random(len(centres))
    union = construct(
        "shapes",
        {
            "type": "union",
            "of": [
                {"type": "disc", "radius": float(r), "centre": c.tolist()}
                for c, r in zip(centres, radii, strict=True)
            ],
        },
    )
    points = np.random.default_rng(2).uniform(-2.0, 9.0, (3000, 2))
    each = np.linalg.norm(points[:, None] - centres, axis=2) - radii
    assert np.abs(union.signed_distance(points) - each.min(axis=1)).max() < 1e-14


@pytest.mark.parametrize("count", [3, 30, 3000])
def test_an_outline_that_crosses_itself_is_found(count: int) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    round_about = np.stack([np.cos(angles), np.sin(angles)], axis=1).tolist()
    construct("shapes", {"type": "polygon", "vertices": round_about})
    # From the last corner far out, beyond the first edge, and back through it.
    middle = 0.5 * (np.array(round_about[0]) + np.array(round_about[1]))
    with pytest.raises(SceneError, match="edge-0 meets edge-"):
        construct(
            "shapes",
            {
                "type": "polygon",
                "vertices": [*round_about, (1.5 * middle).tolist(), (0.9 * middle).tolist()],
            },
        )


def test_of_a_tangled_outline_not_all_crossings_are_looked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Of 3000 edges at random, 4.5 million pairs, about every fourth crosses: it takes the first
    # of many lots to find one.
    looked: list[int] = []
    cross = _outline._cross
    monkeypatch.setattr(_outline, "_AT_ONCE", 10_000)
    monkeypatch.setattr(_outline, "_cross", lambda a, b: looked.append(len(a)) or cross(a, b))
    vertices = np.random.default_rng(1).uniform(size=(3000, 2)).tolist()
    with pytest.raises(SceneError, match=r"edge-\d+ meets edge-\d+"):
        construct("shapes", {"type": "polygon", "vertices": vertices})
    assert sum(looked) < 5 * 2 * 10_000
