"""Which particle is nearest to each of many points; those equally near share the point."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.arrays import Array, Indices

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
