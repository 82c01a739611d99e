"""Edges and corners found from samples of a surface."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.interfaces.shape import Shape
from solidsph_builtin.discretisations import _features
from solidsph_builtin.discretisations._features import gap, meetings, smooth
from solidsph_builtin.discretisations._sampled_once import sampled_once
from solidsph_builtin.shapes.ball import Ball
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.cylinder import Cylinder
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.polygon import Polygon

SLAB = Box(lengths=[1.0, 0.7, 0.1], origin=[3.0, -2.0, 0.0])


@pytest.mark.parametrize(
    "shape",
    [
        SLAB,
        Polygon(vertices=((0.0, 0.0), (4.8, 4.4), (4.8, 6.0), (0.0, 4.4))),
        Cylinder(radius=0.5, length=1.3),
        Difference(SLAB, [Ball(radius=0.3, centre=(3.5, -1.7, 0.0))]),
    ],
)
def test_nothing_is_missed_deep_in_smooth_faces(
    shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if all pairs of samples were compared, to the last bit."""
    samples = smooth(shape.surface(0.1))
    reach = gap(shape.surface(0.1))
    found = meetings(samples, reach)
    beside = _features._beside_bends(samples, 2.0 * reach)
    assert 0 < len(beside) <= len(samples.points)
    monkeypatch.setattr(_features, "_beside_bends", lambda of, _: np.arange(len(of.points)))
    expected = meetings(samples, reach)
    assert len(found.points) > 0
    assert np.array_equal(found.points, expected.points)
    assert np.array_equal(found.normals, expected.normals)


def test_most_of_a_flat_face_is_deep() -> None:
    box = Box(lengths=[1.0, 1.0, 1.0])
    samples, reach = smooth(box.surface(0.05)), gap(box.surface(0.05))
    assert len(_features._beside_bends(samples, 2.0 * reach)) < 0.4 * len(samples.points)


def test_a_surface_is_sampled_once_at_every_spacing() -> None:
    once = sampled_once(SLAB)
    assert sampled_once(once) is once
    assert once.surface(0.1) is once.surface(0.1)
    assert len(once.surface(0.05).points) > len(once.surface(0.1).points)
    assert np.array_equal(once.surface(0.1).points, SLAB.surface(0.1).points)
    assert (once.dimension, once.volume(), once.convex) == (3, SLAB.volume(), True)
