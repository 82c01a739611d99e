"""How deep two shapes lie in each other."""

from __future__ import annotations

from itertools import product

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array

# Cells looked at in the first round, and in a later one at most.
_FIRST_CELLS = 4096
_MOST_CELLS = 100_000

# So many places that seem to lie in both shapes are looked at closely.
_DEEPEST = 64


@attrs.frozen(eq=False)
class Overlap:
    """Where two shapes are in one place."""

    depth: float  # diameter of a ball that fits into both [m]
    place: Array  # its centre (d,) [m]


def overlap(one: Shape, other: Shape, least: float) -> Overlap | None:
    """The deepest place where two shapes overlap by more than `least` [m]; None if there is none.

    The boxes of the shapes have a box in common, which is cut into ever smaller cells. Only cells
    that may hold a point inside both shapes are cut further, until they are as small as twice
    `least`.

    A thin overlap would be missed for long in this way. But a point that is so deep inside one
    shape is at least so far outside the other, if the two are apart; where the signed distances add
    up to less than 0, the point half-way between the two surfaces is looked at, too.
    """
    first, second = one.bounds(), other.bounds()
    lower = np.maximum(first[0], second[0])
    extent = np.minimum(first[1], second[1]) - lower
    if np.any(extent <= least):
        return None
    d = len(extent)
    corners = np.array(list(product((-0.25, 0.25), repeat=d)))
    centres, sides = _cells(lower, extent)
    deepest, place = 0.0, centres[0]
    while True:
        distances = _distances(one, other, centres)
        outside = distances.max(axis=0)
        seeming = np.flatnonzero(distances.sum(axis=0) < -least)
        seeming = seeming[np.argsort(outside[seeming])[:_DEEPEST]]
        half_way = _half_way(one, other, centres[seeming], 0.01 * least)
        places = np.concatenate([centres, half_way])
        depths = np.concatenate([outside, _distances(one, other, half_way).max(axis=0)])
        lowest = int(np.argmin(depths))
        if depths[lowest] < deepest:
            deepest, place = float(depths[lowest]), places[lowest]
        if float(sides.max()) <= 2.0 * least:
            break
        near = np.flatnonzero(outside < 0.5 * float(np.linalg.norm(sides)))
        if 2.0 * deepest < -least:  # it remains to see how deep
            near = near[np.argsort(outside[near])[:_DEEPEST]]
        if not len(near) or len(near) * len(corners) > _MOST_CELLS:
            break
        centres = (centres[near][:, None, :] + corners * sides).reshape(-1, d)
        sides = 0.5 * sides
    return Overlap(-2.0 * deepest, place) if 2.0 * deepest < -least else None


def _distances(one: Shape, other: Shape, points: Array) -> Array:
    """From both shapes, (2, k) [m]."""
    if not len(points):
        return np.empty((2, 0))
    return np.array([one.signed_distance(points), other.signed_distance(points)])


def _half_way(one: Shape, other: Shape, points: Array, step: float) -> Array:
    """Points that are as deep in one shape as in the other, by a step of Newton, (k, d) [m]."""
    if not len(points):
        return points
    first, second = _distances(one, other, points)
    slopes = np.empty_like(points)
    for axis, unit in enumerate(np.eye(points.shape[1])):
        ahead, behind = (_distances(one, other, points + way * step * unit) for way in (1.0, -1.0))
        slopes[:, axis] = ((ahead - behind)[0] - (ahead - behind)[1]) / (2.0 * step)
    squares = np.sum(slopes**2, axis=1)
    along = np.divide(first - second, squares, out=np.zeros(len(points)), where=squares > 0.0)
    return np.asarray(points - along[:, None] * slopes)


def _cells(lower: Array, extent: Array) -> tuple[Array, Array]:
    """Middles (k, d) and sides (d,) of cells, about as long as they are wide, that fill a box."""
    d = len(extent)
    side = max(float(extent.min()), float(np.prod(extent) / _FIRST_CELLS) ** (1.0 / d))
    counts = np.maximum(1, np.round(extent / side)).astype(int)
    axes = [
        start + (np.arange(count) + 0.5) * (length / count)
        for start, count, length in zip(lower, counts, extent, strict=True)
    ]
    centres = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    return centres, extent / counts
