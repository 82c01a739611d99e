"""Points near each other: which particle each is nearest to, and which stay when they crowd."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask

# At a point on a diagonal of a lattice, a particle on each axis may be as near.
_MOST_EQUAL = 4
_EQUAL = 1e-9


@attrs.frozen(eq=False)
class Assignment:
    """Points that go to particles: one entry for each pair."""

    particles: Indices  # (k,)
    points: Indices  # (k,)
    shares: Array  # (k,) what part of the point goes to the particle; 1 in all for a point [-]

    def sums(self, values: Array, count: int) -> Array:
        """What each of `count` particles gets of the `values` (m,) of the points, (count,)."""
        weights = self.shares * values[self.points]
        return np.bincount(self.particles, weights, minlength=count).astype(np.float64, copy=False)


def nearest(tree: cKDTree, points: Array) -> Assignment:
    """Each of `points` (m, d) to the particle of the `tree` nearest to it.

    Sharing keeps a symmetric body symmetric: which one of several the tree finds is arbitrary.
    """
    count = min(_MOST_EQUAL, tree.n)
    distances, found = map(np.asarray, tree.query(points, k=np.arange(1, count + 1)))
    equal = distances <= distances[:, :1] * (1.0 + _EQUAL)
    at, rank = np.nonzero(equal)
    return Assignment(
        particles=np.asarray(found[at, rank], dtype=np.intp),
        points=at,
        shares=1.0 / equal.sum(axis=1)[at],
    )


def thinned(points: Array, order: Indices, distance: float) -> Mask:
    """Which of `points` (m, d) stay when, taken in this `order`, each drops all that are less than
    `distance` away and have not been kept before, (m,)."""
    stays = np.ones(len(points), dtype=np.bool_)
    kept = np.zeros(len(points), dtype=np.bool_)
    close = cKDTree(points).query_ball_point(points, distance)
    for one in order.tolist():
        if stays[one]:
            kept[one] = True
            others = np.array(close[one])
            stays[others[~kept[others]]] = False
    return stays
