"""Assignment of points to the nearest particles, and thinning of crowded points."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask

# A point on a diagonal of a lattice may be equally near to a particle on each axis.
_MOST_EQUAL = 4
_EQUAL = 1e-9


@attrs.frozen(eq=False)
class Assignment:
    """Points assigned to particles: one entry for each pair."""

    particles: Indices  # (k,)
    points: Indices  # (k,)
    shares: Array  # (k,) share of the point that the particle gets; 1 in total for a point [-]

    def sums(self, values: Array, count: int) -> Array:
        """Sum of the `values` (m,) of the points for each of `count` particles, (count,)."""
        weights = self.shares * values[self.points]
        return np.bincount(self.particles, weights, minlength=count).astype(np.float64, copy=False)


def nearest(tree: cKDTree, points: Array) -> Assignment:
    """Each of `points` (m, d) assigned to the nearest particle of the `tree`.

    Equally near particles share a point, which keeps a symmetric body symmetric: which of them the
    tree finds first is arbitrary.
    """
    count = min(_MOST_EQUAL, tree.n)
    distances, particles = map(np.asarray, tree.query(points, k=np.arange(1, count + 1)))
    equal = distances <= distances[:, :1] * (1.0 + _EQUAL)
    at, rank = np.nonzero(equal)
    return Assignment(
        particles=np.asarray(particles[at, rank], dtype=np.intp),
        points=at,
        shares=1.0 / equal.sum(axis=1)[at],
    )


def beside(others: Array, points: Array, distance: float) -> Mask:
    """Which of `points` (m, d) are less than a `distance` [m] from one of `others` (k, d), (m,)."""
    gaps = cKDTree(others).query(points, distance_upper_bound=distance)[0]
    return np.isfinite(gaps)


def thinned(points: Array, order: Indices, distance: float) -> Mask:
    """Which of `points` (m, d) stay if each, in this `order`, removes all that are less than
    `distance` away and have not been kept before, (m,)."""
    return thinned_pairs(cKDTree(points).query_pairs(distance, output_type="ndarray"), order)


def thinned_pairs(pairs: Indices, order: Indices) -> Mask:
    """The same of points that are too close in `pairs` (m, 2), which are changed."""
    count = len(order)
    rank = np.empty(count, dtype=np.intp)
    rank[order] = np.arange(count)
    swapped = rank[pairs[:, 0]] > rank[pairs[:, 1]]
    pairs[swapped] = pairs[swapped, ::-1]
    open_, kept = np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    # All at once that have none before them any more.
    while open_.any():
        pairs = pairs[open_[pairs].all(axis=1)]
        first = open_.copy()
        first[pairs[:, 1]] = False
        kept |= first
        open_ &= ~first
        open_[pairs[first[pairs[:, 0]], 1]] = False
    return kept
