"""Samples of the inside of plane shapes, for the flat ends of bodies made of them."""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._sampling import ON_SURFACE, midpoints

# Samples this far outside, in parts of their width, still reach in at a corner.
_REACH = 0.5
_AT_ONCE = 1 << 18


def flat(shape: Shape, spacing: float) -> tuple[Array, Array]:
    """Points of a plane shape (m, 2) [m] and the area of each (m,) [m^2].

    A square grid over its bounding box, which matches the lattice of that, cut by the outline. Cut
    squares are scaled to the exact area.
    """
    lower, upper = shape.bounds()
    x, y = (
        low + midpoints(high - low, spacing, ON_SURFACE)
        for low, high in zip(lower.tolist(), upper.tolist(), strict=True)
    )
    steps = (upper - lower) / (len(x), len(y))
    width = float(steps.min())
    points, shares = [], []
    for some in np.array_split(x, 1 + len(x) * len(y) // _AT_ONCE):
        grid = np.stack(np.meshgrid(some, y, indexing="ij"), axis=-1).reshape(-1, 2)
        distance = shape.signed_distance(grid)
        # The part of a square inside a straight outline.
        inside = np.clip(_REACH - distance / width, 0.0, 1.0)
        kept = inside > 0.0
        points.append(_moved_in(shape, grid[kept], distance[kept], width))
        shares.append(inside[kept])
    where, areas = np.concatenate(points), np.concatenate(shares) * float(np.prod(steps))
    cut = np.concatenate(shares) < 1.0
    if cut.any():
        areas[cut] *= (area_of(shape, spacing) - areas[~cut].sum()) / areas[cut].sum()
    return where, areas


def area_of(shape: Shape, spacing: float) -> float:
    """Area of a plane shape, by its outline where no closed form is known [m^2]."""
    known = shape.volume()
    if known is not None:
        return known
    outline = shape.surface(spacing)
    middle = 0.5 * np.sum(shape.bounds(), axis=0)
    return 0.5 * float(np.vdot(outline.points - middle, outline.area_vectors))


def _moved_in(shape: Shape, points: Array, distance: Array, width: float) -> Array:
    """The points (m, 2), those outside moved onto the outline along the slope of the distance."""
    out = np.flatnonzero(distance > 0.0)
    if not out.size:
        return points
    step = 1e-4 * width
    slope = np.stack(
        [
            shape.signed_distance(points[out] + step * axis)
            - shape.signed_distance(points[out] - step * axis)
            for axis in np.eye(2)
        ],
        axis=1,
    )
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    moved = points.copy()
    moved[out] -= distance[out, None] * slope / np.where(length > 0.0, length, 1.0)
    return moved
