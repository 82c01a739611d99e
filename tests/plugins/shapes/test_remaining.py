"""Samples of shapes made of other shapes, against a test of every sample of every part."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.interfaces.shape import Shape
from solidsph_builtin.shapes.ball import Ball
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc
from solidsph_builtin.shapes.union import Union


def counted(shape: Difference | Union, parts: list[Shape], spacing: float) -> int:
    """Samples of the parts' surfaces with the shape on one side only."""
    kept = 0
    for part in parts:
        surface = part.surface(spacing)
        normals = surface.area_vectors / np.linalg.norm(surface.area_vectors, axis=1)[:, None]
        sides = [
            shape.signed_distance(surface.points + sign * 1e-6 * spacing * normals) < 0.0
            for sign in (-1.0, 1.0)
        ]
        kept += int(np.sum(sides[0] != sides[1]))
    return kept


@pytest.mark.parametrize("times", [1.5, 3.0, 10.0])
def test_a_removed_shape_may_be_much_larger_than_the_body(times: float) -> None:
    ball = Ball(radius=1.0)
    half = Box(lengths=[2.0 * times, 2.0 * times, times], origin=[-times, -times, -times])
    surface = Difference(ball, [half]).surface(0.2)
    assert len(surface.points) == counted(Difference(ball, [half]), [ball, half], 0.2)
    # The flat face is a disc, the rest half of a sphere.
    flat = surface.area_vectors[np.array(surface.faces) == "back"]
    # A sample of a square grid is in the disc or not: off by less than half a sample all round.
    assert flat[:, 2].sum() == pytest.approx(-np.pi, rel=0.05)
    assert surface.area_vectors.sum(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=0.15)


@given(
    centre=st.tuples(st.floats(-0.4, 1.6), st.floats(-0.4, 1.2)),
    radius=st.floats(0.05, 0.6),
    joined=st.booleans(),
)
def test_samples_are_those_with_the_body_on_one_side(
    centre: tuple[float, float], radius: float, joined: bool
) -> None:
    box, disc = Box(lengths=[1.2, 0.8]), Disc(radius=radius, centre=centre)
    shape = Union([box, disc]) if joined else Difference(box, [disc])
    surface = shape.surface(0.1)
    assert len(surface.points) == counted(shape, [box, disc], 0.1)
    assert len(surface.faces) == len(surface.area_vectors) == len(surface.points)
