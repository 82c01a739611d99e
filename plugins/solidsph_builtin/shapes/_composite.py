"""Helpers of shapes made of other shapes: their parts, and what remains of the boundaries."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from itertools import chain, compress
from reprlib import repr as short
from typing import Any

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_tuple, refusal
from solidsph_builtin.shapes._sampling import unit
from solidsph_builtin.shapes.named import Named


def as_parts(value: Any) -> Any:
    """One shape, a list, or a table of them by name, as a tuple; anything else unchanged."""
    if isinstance(value, Mapping):
        return tuple(Named(name, part) for name, part in value.items())
    return (value,) if isinstance(value, Shape) else as_tuple(value, lambda part: part)


def as_shape(value: Any) -> Any:
    """A table with one shape by its name as that; anything else unchanged."""
    if isinstance(value, Mapping) and len(value) == 1:
        return as_parts(value)[0]
    return value


def check_shape(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    """Refuse a value that is no shape."""
    if not isinstance(value, Shape):
        raise refusal(shape, field.name, "a shape", short(value))


def check_parts(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    """Refuse a value that is not one or several shapes of equal dimension."""
    if not (isinstance(value, tuple) and value and all(isinstance(p, Shape) for p in value)):
        raise refusal(shape, field.name, "one or several shapes", short(value))
    dimensions = tuple(part.dimension for part in value)
    if len(set(dimensions)) > 1:
        raise refusal(shape, field.name, "shapes of equal dimension", f"dimensions {dimensions}")


def corners(parts: Sequence[Shape]) -> tuple[Array, Array]:
    """Lower and upper corners of the boxes of shapes, each (k, d) [m]."""
    lower, upper = zip(*(part.bounds() for part in parts), strict=True)
    return np.array(lower), np.array(upper)


def remaining(
    whole: Shape, parts: Sequence[Shape], surfaces: Sequence[Surface], spacing: float
) -> Surface:
    """The samples of the parts' boundaries that lie on the boundary of the `whole`.

    A sample is kept if the whole is just behind it and not just in front of it. That drops samples
    inside another part and a face that two parts share back to back. A face that two parts have in
    common side by side is kept once, from the first of them.

    Args:
        whole: the shape made of the parts.
        parts: its parts.
        surfaces: the boundary of each part, with normals that point out of the whole.
        spacing: distance of the samples [m].
    """
    # Far above rounding, far below what the samples resolve.
    step = 1e-6 * spacing
    # A removed shape may be much larger than the body.
    low, high = whole.bounds()
    bounded = [_inside(surface, low - 2.0 * step, high + 2.0 * step) for surface in surfaces]
    points = np.concatenate([surface.points for surface in bounded])
    area_vectors = np.concatenate([surface.area_vectors for surface in bounded])
    ahead = step * unit(area_vectors)
    some = np.flatnonzero(whole.signed_distance(points - ahead) < 0.0)
    some = some[whole.signed_distance(points[some] + ahead[some]) > 0.0]
    stays = np.zeros(len(points), dtype=np.bool_)
    stays[some] = True
    lower, upper = corners(parts)
    first = 0
    for i, surface in enumerate(bounded):
        own = first + np.flatnonzero(stays[first : first + len(surface.points)])
        first += len(surface.points)
        if not own.size:
            continue
        # Only a part whose box is so near has a boundary there.
        low, high = points[own].min(axis=0) - 2.0 * step, points[own].max(axis=0) + 2.0 * step
        near = ((lower[:i] <= high) & (upper[:i] >= low)).all(axis=1)
        for earlier in np.flatnonzero(near).tolist():
            stays[own] &= np.abs(parts[earlier].signed_distance(points[own])) > step
    faces = chain.from_iterable(surface.faces for surface in bounded)
    return Surface(points[stays], area_vectors[stays], tuple(compress(faces, stays.tolist())))


def _inside(surface: Surface, low: Array, high: Array) -> Surface:
    """The samples of a surface in the box from `low` to `high`, both (d,) [m]."""
    columns = zip(surface.points.T, low, high, strict=True)
    inside = functools.reduce(np.logical_and, ((x >= a) & (x <= b) for x, a, b in columns))
    if inside.all():
        return surface
    some = np.flatnonzero(inside)
    names = np.array(surface.faces, dtype=object)[some]
    return Surface(surface.points[some], surface.area_vectors[some], tuple(names.tolist()))
