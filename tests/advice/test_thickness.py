"""How thick a body is: thin parts are found, and sharp corners are none."""

from __future__ import annotations

from collections.abc import Mapping
from math import radians, tan
from typing import Any

import pytest

from solidsph.advice.thickness import Rays, rays_through
from solidsph.registry.construct import construct

Table = Mapping[str, Any]
WIDEST = 7.0  # of the largest ball inside, as if it were known


def box(*lengths: float, at: tuple[float, ...] | None = None) -> Table:
    return {"type": "box", "lengths": list(lengths), "origin": list(at or [0.0] * len(lengths))}


def union(*parts: Table) -> Table:
    return {"type": "union", "of": list(parts)}


def less(of: Table, *minus: Table) -> Table:
    return {"type": "difference", "of": of, "minus": list(minus)}


def polygon(*vertices: tuple[float, float]) -> Table:
    return {"type": "polygon", "vertices": [list(one) for one in vertices]}


def rays(shape: Table, spacing: float) -> Rays:
    return rays_through(construct("shapes", shape), spacing)


WEB = polygon(
    (0, 0), (1, 0), (1, 0.4), (1.5, 0.4), (1.5, 0), (2.5, 1), (1.5, 1), (1.5, 0.45), (1, 0.45),
    (1, 1), (0, 1),
)  # fmt: skip
NOTCHES = (
    polygon((0.55, 1.1), (1.45, 1.1), (1, 0.55)),
    polygon((0.55, -0.1), (1.45, -0.1), (1, 0.45)),
)


@pytest.mark.parametrize(
    ("shape", "spacing", "thickness"),
    [
        (box(1, 0.1), 0.02, 0.1),
        (box(1, 1), 0.05, 1.0),
        ({"type": "annulus", "inner_radius": 0.4, "outer_radius": 0.5}, 0.02, 0.1),
        ({"type": "disc", "radius": 0.5}, 0.05, 1.0),
        (box(1, 1, 0.2), 0.1, 0.2),
        ({"type": "cylinder", "radius": 1.0, "length": 0.1}, 0.1, 0.1),
        ({"type": "ball", "radius": 0.5}, 0.1, 1.0),
        (union(box(1, 1), box(0.2, 0.05, at=(0.95, 0.5)), box(1, 1, at=(1.1, 0))), 0.05, 0.05),
        (union(box(1, 1), box(0.5, 0.1, at=(1, 0.4))), 0.05, 0.1),
        (union(box(1, 1, 1), box(1, 0.2, 0.2, at=(1, 0.4, 0.4))), 0.1, 0.2),
        (union(box(1, 0.1), box(1, 0.1, at=(0, 0.1))), 0.02, 0.2),  # what meets there is one
        (less(box(1, 1), box(0.05, 0.9, at=(0.45, 0.1))), 0.02, 0.1),
        (less(box(0.3, 0.2), {"type": "disc", "radius": 0.08, "centre": [0.15, 0.1]}), 0.01, 0.02),
        (WEB, 0.05, 0.05),  # corners of 45 degrees beside it
    ],
)
def test_a_thin_part_is_found(shape: Table, spacing: float, thickness: float) -> None:
    # Curved sides are sampled a sixteenth of a spacing apart, in space a quarter.
    assert rays(shape, spacing).least(WIDEST) == pytest.approx(thickness, rel=0.01)


def test_a_neck_between_notches_is_found_though_nowhere_two_sides_are_parallel() -> None:
    # 0.1 from tip to tip; samples stand half a sixteenth of a spacing from each.
    assert rays(less(box(2, 1), *NOTCHES), 0.05).least(WIDEST) == pytest.approx(0.1, abs=0.05 / 16)
    deep = less(box(2, 1), polygon((0.1, 1), (1.9, 1), (1, 0.1)))
    assert rays(deep, 0.05).least(WIDEST) == pytest.approx(0.1, abs=0.05 / 16)


def test_what_tapers_to_a_blunt_end_is_as_thick_as_that() -> None:
    found = rays(polygon((0, 0), (1, 0.08), (1, 0.12), (0, 0.2)), 0.02).least(WIDEST)
    # The thinnest 3 % of its surface are left out: 0.03 of its length, along which it gains 0.16.
    assert found == pytest.approx(0.04, abs=0.03 * 0.16 + 0.002)


@pytest.mark.parametrize(
    ("shape", "spacing", "least"),
    [
        # Cook's membrane: across its narrow end, from its upper edge along the normal, 15.2.
        (polygon((0, 0), (48, 44), (48, 60), (0, 44)), 2.0, 15.0),
        # A corner of 20 degrees at either end of a sheet that is 0.364 wide.
        (polygon((0, 0), (2, 0), (3, 0.364), (1, 0.364)), 0.05, 0.36),
        (polygon((0, 0), (1, 0), (2, 1), (1, 1)), 0.05, 0.7),
        (polygon((0, 0), (1, 0), (1, 0.5)), 0.02, 0.2),
        # A hole that cuts an edge leaves two sharp corners, and 0.2 below and beside itself.
        (less(box(1, 1), {"type": "disc", "radius": 0.3, "centre": [0.5, 0.8]}), 0.05, 0.19),
    ],
)
def test_a_sharp_corner_is_no_thin_part(shape: Table, spacing: float, least: float) -> None:
    assert rays(shape, spacing).least(WIDEST) > least


def test_a_body_of_corners_alone_is_as_thick_as_the_largest_ball() -> None:
    triangle = polygon((0, 0), (1, 0), (0.5, 0.866))
    assert rays(triangle, 0.05).least(0.577) == 0.577


@pytest.mark.parametrize("degrees", [2.0, 10.0])
def test_a_thin_wedge_is_as_thick_as_its_middle(degrees: float) -> None:
    thick = tan(radians(degrees))
    found = rays(polygon((0, 0), (1, 0), (1, thick)), 0.1 * thick).least(WIDEST)
    assert found == pytest.approx(0.5 * thick, rel=0.05)
