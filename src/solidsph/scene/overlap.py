"""Depth of the overlap of two shapes."""

from __future__ import annotations

from itertools import product

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array

# Cells in the first round, and at most in a later one.
_FIRST_CELLS = 4096
_MOST_CELLS = 100_000

# Number of points near both shapes that are examined closely.
_DEEPEST = 64


@attrs.frozen(eq=False)
class Overlap:
    """Overlap of two shapes."""

    depth: float  # diameter of the largest common ball [m]
    place: Array  # its centre (d,) [m]


def overlap(first: Shape, second: Shape, least: float) -> Overlap | None:
    """Deepest overlap of two shapes, if it exceeds `least` [m]; None otherwise.

    The intersection of the bounding boxes is divided into cells. Cells that may contain a point
    inside both shapes are divided further, down to a size of twice `least`.

    This would find a thin overlap late. But if two shapes are apart, a point inside one is at
    least as far outside the other. So where the signed distances have a negative sum, the point
    half-way between the two surfaces is examined too.
    """
    boxes = first.bounds(), second.bounds()
    lower = np.maximum(boxes[0][0], boxes[1][0])
    extent = np.minimum(boxes[0][1], boxes[1][1]) - lower
    if np.any(extent <= least):
        return None
    d = len(extent)
    corners = np.array(list(product((-0.25, 0.25), repeat=d)))
    centres, sides = _cells(lower, extent)
    deepest, place = 0.0, centres[0]
    while True:
        distances = _distances(first, second, centres)
        outside = distances.max(axis=0)
        candidates = np.flatnonzero(distances.sum(axis=0) < -least)
        candidates = candidates[np.argsort(outside[candidates])[:_DEEPEST]]
        half_way = _half_way(first, second, centres[candidates], 0.01 * least)
        places = np.concatenate([centres, half_way])
        depths = np.concatenate([outside, _distances(first, second, half_way).max(axis=0)])
        lowest = int(np.argmin(depths))
        if depths[lowest] < deepest:
            deepest, place = float(depths[lowest]), places[lowest]
        if float(sides.max()) <= 2.0 * least:
            break
        near = np.flatnonzero(outside < 0.5 * float(np.linalg.norm(sides)))
        if 2.0 * deepest < -least:  # only the depth is left to find
            near = near[np.argsort(outside[near])[:_DEEPEST]]
        if not len(near) or len(near) * len(corners) > _MOST_CELLS:
            break
        centres = (centres[near][:, None, :] + corners * sides).reshape(-1, d)
        sides = 0.5 * sides
    return Overlap(-2.0 * deepest, place) if 2.0 * deepest < -least else None


def _distances(first: Shape, second: Shape, points: Array) -> Array:
    """Signed distances from both shapes, (2, k) [m]."""
    if not len(points):
        return np.empty((2, 0))
    return np.array([first.signed_distance(points), second.signed_distance(points)])


def _half_way(first: Shape, second: Shape, points: Array, step: float) -> Array:
    """Points at equal depth in both shapes, by one Newton step, (k, d) [m]."""
    if not len(points):
        return points
    distances = _distances(first, second, points)
    slopes = np.empty_like(points)
    for axis, unit in enumerate(np.eye(points.shape[1])):
        ahead, behind = (_distances(first, second, points + s * step * unit) for s in (1.0, -1.0))
        slopes[:, axis] = ((ahead - behind)[0] - (ahead - behind)[1]) / (2.0 * step)
    squares = np.sum(slopes**2, axis=1)
    along = np.divide(
        distances[0] - distances[1], squares, out=np.zeros(len(points)), where=squares > 0.0
    )
    return np.asarray(points - along[:, None] * slopes)


def _cells(lower: Array, extent: Array) -> tuple[Array, Array]:
    """Centres (k, d) and sides (d,) of nearly cubic cells that fill a box."""
    d = len(extent)
    side = max(float(extent.min()), float(np.prod(extent) / _FIRST_CELLS) ** (1.0 / d))
    counts = np.maximum(1, np.round(extent / side)).astype(int)
    axes = [
        start + (np.arange(count) + 0.5) * (length / count)
        for start, count, length in zip(lower, counts, extent, strict=True)
    ]
    centres = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    return centres, extent / counts
