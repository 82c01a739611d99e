"""Visibility of neighbours: the straight line between two neighbours stays inside the body.

Criterion of Belytschko, Lu and Gu (1994), Int. J. Numer. Meth. Engng 37, 229-256: particles across
a gap, a slot or a notch are no neighbours.

Lines are checked by the signed distance of the shape. A point at depth D clears the line over a
length D on both sides; the rest is bisected. Every line that leaves the body by more than two
tolerances is found. Lines between sufficiently deep points need no check.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Hidden, neighbour_pairs
from solidsph.model.particles import Particles

# Depth at which lines start and end [spacings]. A particle stands for a piece of the body about one
# spacing wide, wherever in it the discretisation puts it. So a line along a surface stays inside,
# and so does one past a smooth hole, unless the hole is as small as the support.
_DEPTH = 0.5

# Distance by which a line may leave the body [spacings], for shapes that touch up to rounding. Gaps
# wider than four of these are always found.
_TOLERANCE = 0.01

# Step of differences of the signed distance, for the direction into the body [spacings].
_STEP = 1e-3

# Attempts to move a line's end to its depth; each halves the way where the body is thin.
_ATTEMPTS = 8

_ROWS_AT_ONCE = 1024
_LINES_AT_ONCE = 1 << 15


def hidden_pairs(
    shape: Shape, particles: Particles, radius: float, *, moving: bool = False
) -> Hidden | None:
    """Pairs of particles within a support that cannot see each other; None if there are none.

    Ghosts lie outside the body and see all particles.

    Args:
        shape: shape of the body.
        particles: its particles.
        radius: support radius [m].
        moving: whether neighbours are searched again as particles move. Pieces of the body that
            no chain of neighbours connects then never become neighbours.
    """
    if shape.convex:
        return None
    X, n = particles.positions, particles.count
    real = np.flatnonzero(~particles.ghosts)
    spacing = float(particles.spacings.min())
    points, depths = _line_ends(shape, X[real], spacing)
    pairs = [
        real[ends[:, _leave(shape, points, depths, ends, _TOLERANCE * spacing)]]
        for ends in _near_surface(X[real], depths, radius, spacing)
    ]
    p, q = np.concatenate(pairs, axis=1) if pairs else np.empty((2, 0), dtype=np.intp)
    hidden = Hidden(np.sort(np.concatenate([p * n + q, q * n + p])), n)
    if moving:
        visible = neighbour_pairs(X, radius, hidden)
        graph = visible.matrix(np.ones(visible.count))
        count, pieces = connected_components(graph, directed=False)
        if count > 1:
            return Hidden(hidden.keys, n, pieces.astype(np.intp))
    return hidden if len(hidden.keys) else None


def _line_ends(shape: Shape, X: Array, spacing: float) -> tuple[Array, Array]:
    """Ends of lines from particles at X (n, d), (n, d), and their depths, (n,) [m]."""
    points, depths = X.copy(), -shape.signed_distance(X)
    wanted, share = _DEPTH * spacing, np.ones(len(X))
    for _ in range(_ATTEMPTS):
        near = np.flatnonzero(depths < (1.0 - 1e-9) * wanted)
        if not near.size:
            break
        inwards = _inwards(shape, points[near], _STEP * spacing)
        way = share[near] * (wanted - depths[near])
        moved = points[near] + way[:, None] * inwards
        reached = -shape.signed_distance(moved)
        # A step towards a corner gains least: 1 / sqrt(3) of its length in 3D.
        gains = reached >= depths[near] + 0.5 * way
        points[near[gains]], depths[near[gains]] = moved[gains], reached[gains]
        share[near[~gains]] *= 0.5
    return points, depths


def _inwards(shape: Shape, points: Array, step: float) -> Array:
    """Unit vectors of increasing depth, (m, d); zero where there is none."""
    slopes = np.empty_like(points)
    for axis, along in enumerate(step * np.eye(points.shape[1])):
        slopes[:, axis] = shape.signed_distance(points - along) - shape.signed_distance(
            points + along
        )
    lengths = np.linalg.norm(slopes, axis=1, keepdims=True)
    away = lengths > 1e-3 * step
    return np.asarray(np.where(away, slopes / np.where(away, lengths, 1.0), 0.0))


def _near_surface(X: Array, depths: Array, radius: float, spacing: float) -> Iterator[Indices]:
    """Arrays (2, k) of neighbour pairs whose depths do not clear the line between them."""
    # The ends of a line may be up to a spacing further apart than its particles.
    longest = radius + 2.0 * _DEPTH * spacing
    shallow = np.flatnonzero(depths < longest)
    shallow = shallow[np.argsort(depths[shallow], kind="stable")]
    if not shallow.size:
        return
    tree = cKDTree(X[shallow])
    starts = int(np.searchsorted(depths[shallow], 0.5 * longest))  # the shallower of two ends
    for first in range(0, starts, _ROWS_AT_ONCE):
        rows = shallow[first : min(first + _ROWS_AT_ONCE, starts)]
        near = cKDTree(X[rows]).sparse_distance_matrix(tree, radius, output_type="ndarray")
        later = near["j"] > near["i"] + first
        ends = np.stack([rows[near["i"][later]], shallow[near["j"][later]]])
        open_ = depths[ends].sum(axis=0) < near["v"][later] + 2.0 * _DEPTH * spacing
        yield ends[:, open_]


def _leave(shape: Shape, points: Array, depths: Array, ends: Indices, tolerance: float) -> Mask:
    """Whether the line between the points `ends` (2, k) leaves the body, (k,)."""
    return np.concatenate(
        [
            _lines_leave(shape, points[ends[:, some]], depths[ends[:, some]], tolerance)
            for some in (
                slice(first, first + _LINES_AT_ONCE)
                for first in range(0, max(1, ends.shape[1]), _LINES_AT_ONCE)
            )
        ]
    )


def _lines_leave(shape: Shape, ends: Array, depths: Array, tolerance: float) -> Mask:
    """`_leave` for pairs of points (2, k, d) at depths (2, k)."""
    start, along = ends[0], ends[1] - ends[0]
    lengths = np.linalg.norm(along, axis=1)
    along /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
    low, high = np.maximum(depths[0], 0.0), lengths - np.maximum(depths[1], 0.0)
    line = np.flatnonzero(high > low)
    low, high = low[line], high[line]
    leaves = np.zeros(len(lengths), dtype=np.bool_)
    while line.size:
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        outside = shape.signed_distance(start[line] + middle[:, None] * along[line])
        leaves[line[outside > tolerance]] = True
        split = ~leaves[line] & (half > tolerance) & (outside > -half)
        clear = np.maximum(-outside[split], 0.0)
        line = np.concatenate([line[split], line[split]])
        low, high = (
            np.concatenate([low[split], middle[split] + clear]),
            np.concatenate([middle[split] - clear, high[split]]),
        )
    return leaves
