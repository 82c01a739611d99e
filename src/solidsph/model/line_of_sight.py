"""Lines of sight: whether the straight line between two points of a body stays inside it.

Lines are checked by the signed distance of the shape. A point at depth D clears the line over a
length D on both sides; the rest is bisected. Every line that leaves the body by more than two
tolerances is found.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from solidsph.maths.arrays import Array, Indices, Mask

SignedDistance: TypeAlias = Callable[[Array], Array]
"""Distance from the surface of points (n, d), negative inside, (n,) [m]."""

# Depth at which lines start and end [spacings]. A particle stands for a piece of the body about one
# spacing wide, wherever in it the discretisation puts it. So a line along a surface stays inside,
# and so does one past a smooth hole, unless the hole is as small as the support.
DEPTH = 0.5

# Distance by which a line may leave the body [spacings], for shapes that touch up to rounding. Gaps
# wider than four of these are always found.
_TOLERANCE = 0.01

# Step of differences of the signed distance, for the direction into the body [spacings].
_STEP = 1e-3

# Attempts to move a line's end to its depth; each halves the way where the body is thin.
_ATTEMPTS = 8

_LINES_AT_ONCE = 1 << 15


def line_ends(distance: SignedDistance, X: Array, spacing: Array | float) -> tuple[Array, Array]:
    """Ends of lines from particles at X (n, d), (n, d), and their depths, (n,) [m]."""
    points, depths = X.copy(), -distance(X)
    wanted, share = np.full(len(X), DEPTH * spacing), np.ones(len(X))
    for _ in range(_ATTEMPTS):
        near = np.flatnonzero(depths < (1.0 - 1e-9) * wanted)
        if not near.size:
            break
        inwards = _inwards(distance, points[near], _STEP * float(np.min(spacing)))
        way = share[near] * (wanted[near] - depths[near])
        moved = points[near] + way[:, None] * inwards
        reached = -distance(moved)
        # A step towards a corner gains least: 1 / sqrt(3) of its length in 3D.
        gains = reached >= depths[near] + 0.5 * way
        points[near[gains]], depths[near[gains]] = moved[gains], reached[gains]
        share[near[~gains]] *= 0.5
    return points, depths


def _inwards(distance: SignedDistance, points: Array, step: float) -> Array:
    """Unit vectors of increasing depth, (m, d); zero where there is none."""
    slopes = np.empty_like(points)
    for axis, along in enumerate(step * np.eye(points.shape[1])):
        slopes[:, axis] = distance(points - along) - distance(points + along)
    lengths = np.linalg.norm(slopes, axis=1, keepdims=True)
    away = lengths > 1e-3 * step
    return np.asarray(np.where(away, slopes / np.where(away, lengths, 1.0), 0.0))


def lines_leave(
    distance: SignedDistance, points: Array, depths: Array, ends: Indices, spacing: float
) -> Mask:
    """Whether lines leave the body, (k,).

    Args:
        distance: of the shape.
        points: ends of lines, (n, d) [m].
        depths: of these points, (n,) [m].
        ends: two of the points for each line, (2, k).
        spacing: of the particles [m].
    """
    tolerance = _TOLERANCE * spacing
    return np.concatenate(
        [
            _some_leave(distance, points[ends[:, some]], depths[ends[:, some]], tolerance)
            for some in (
                slice(first, first + _LINES_AT_ONCE)
                for first in range(0, max(1, ends.shape[1]), _LINES_AT_ONCE)
            )
        ]
    )


def _some_leave(distance: SignedDistance, ends: Array, depths: Array, tolerance: float) -> Mask:
    """`lines_leave` for pairs of points (2, k, d) at depths (2, k)."""
    start, along = ends[0], ends[1] - ends[0]
    lengths = np.linalg.norm(along, axis=1)
    along /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
    low, high = np.maximum(depths[0], 0.0), lengths - np.maximum(depths[1], 0.0)
    line = np.flatnonzero(high > low)
    low, high = low[line], high[line]
    leaves = np.zeros(len(lengths), dtype=np.bool_)
    while line.size:
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        outside = distance(start[line] + middle[:, None] * along[line])
        leaves[line[outside > tolerance]] = True
        split = ~leaves[line] & (half > tolerance) & (outside > -half)
        clear = np.maximum(-outside[split], 0.0)
        line = np.concatenate([line[split], line[split]])
        low, high = (
            np.concatenate([low[split], middle[split] + clear]),
            np.concatenate([middle[split] - clear, high[split]]),
        )
    return leaves
