"""Visibility of neighbours: the straight line between two neighbours stays inside the body.

Criterion of Belytschko, Lu and Gu (1994), Int. J. Numer. Meth. Engng 37, 229-256: particles across
a gap, a slot or a notch are no neighbours. Lines between sufficiently deep particles need no check
(`model/line_of_sight.py`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse.csgraph import connected_components

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices
from solidsph.model.line_of_sight import DEPTH, line_ends, lines_leave
from solidsph.model.neighbours import Hidden, neighbour_pairs
from solidsph.model.pair_search import PairSearch
from solidsph.model.particles import Particles

_ROWS_AT_ONCE = 1024


def hidden_pairs(
    shape: Shape, particles: Particles, radius: Array | float, *, moving: bool = False
) -> Hidden | None:
    """Pairs of particles within a support that cannot see each other; None if there are none.

    Ghosts lie outside the body and see all particles.

    Args:
        shape: shape of the body.
        particles: its particles.
        radius: support radius, one or that of each particle (n,) [m].
        moving: whether neighbours are searched again as particles move. Pieces of the body that
            no chain of neighbours connects then never become neighbours.
    """
    if shape.convex:
        return None
    X, n = particles.positions, particles.count
    real = np.flatnonzero(~particles.ghosts)
    spacings, radii = particles.spacings[real], np.full(n, radius)[real]
    spacing = float(spacings.min())
    points, depths = line_ends(shape.signed_distance, X[real], spacings)
    pairs = [
        real[ends[:, lines_leave(shape.signed_distance, points, depths, ends, spacing)]]
        for ends in _near_surface(X[real], depths, radii, spacings)
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


def _near_surface(X: Array, depths: Array, radii: Array, spacings: Array) -> Iterator[Indices]:
    """Arrays (2, k) of neighbour pairs whose depths do not clear the line between them."""
    # The ends of a line may be up to a spacing further apart than its particles.
    longest = float(radii.max() + 2.0 * DEPTH * spacings.max())
    shallow = np.flatnonzero(depths < longest)
    shallow = shallow[np.argsort(depths[shallow], kind="stable")]
    if not shallow.size:
        return
    search = PairSearch.of(X[shallow], radii[shallow])
    starts = int(np.searchsorted(depths[shallow], 0.5 * longest))  # the shallower of two ends
    for first in range(0, starts, _ROWS_AT_ONCE):
        rows = np.arange(first, min(first + _ROWS_AT_ONCE, starts))
        own, other = search.near(rows)
        later = other > own + first
        ends = np.stack([shallow[own[later] + first], shallow[other[later]]])
        apart = np.linalg.norm(X[ends[1]] - X[ends[0]], axis=1)
        open_ = depths[ends].sum(axis=0) < apart + DEPTH * spacings[ends].sum(axis=0)
        yield ends[:, open_]
