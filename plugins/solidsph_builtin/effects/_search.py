"""Which particles are near each other: asked only where boxes say that some may be."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.arrays import Array, Indices

# A list of pairs has room for this much motion, in parts of the reach.
_SKIN = 0.2


class Search(ABC):
    """Pairs of two groups of particles, or of one group with itself."""

    @abstractmethod
    def asleep(self, x: Array) -> bool:
        """Whether no pair at positions x (m, d) can be within the reach and the margin."""

    @abstractmethod
    def within(self, x: Array, radius: float) -> tuple[Indices, Indices]:
        """Pairs (k,), (k,) no further apart than `radius`, each once, in any order."""


@final
@attrs.frozen(eq=False)
class Between(Search):
    """Particles of two bodies, those of the first before the others."""

    split: int  # how many the first has
    wakes: float  # distance of the boxes at which the search begins [m]

    def asleep(self, x: Array) -> bool:
        one, other = x[: self.split], x[self.split :]
        gaps = np.maximum(one.min(axis=0) - other.max(axis=0), other.min(axis=0) - one.max(axis=0))
        return bool(np.linalg.norm(np.maximum(gaps, 0.0)) > self.wakes)

    def within(self, x: Array, radius: float) -> tuple[Indices, Indices]:
        one = np.arange(self.split)
        other = np.arange(self.split, len(x))
        # All that is inside the other's box, however deep: interiors can touch, too.
        one = one[_inside(x[one], x[other], radius)]
        other = other[_inside(x[other], x[one], radius)] if one.size else other[:0]
        if not other.size:
            return one[:0], other
        found = cKDTree(x[one]).sparse_distance_matrix(
            cKDTree(x[other]), radius, output_type="ndarray"
        )
        return one[found["i"]], other[found["j"]]


@final
@attrs.frozen(eq=False)
class Within(Search):
    """Particles of one body that were far from each other."""

    reference: Array  # X, (m, d) [m]
    apart: float  # distance from which on they count, in the reference configuration [m]
    wakes: float  # distance up to which the search goes on [m]

    def asleep(self, x: Array) -> bool:
        # No two displacements differ by more than the diagonal of the box that holds them all.
        u = x - self.reference
        return bool(np.linalg.norm(np.ptp(u, axis=0)) < self.apart - self.wakes)

    def within(self, x: Array, radius: float) -> tuple[Indices, Indices]:
        found = cKDTree(x).query_pairs(radius, output_type="ndarray")
        i, j = found[:, 0], found[:, 1]
        X = self.reference
        far = np.sum((X[i] - X[j]) ** 2, axis=1) > self.apart**2
        return i[far], j[far]


@attrs.define(eq=False)
class NeighbourList:
    """The pairs within a reach, found anew only when particles have moved by half the skin.

    A pure cache: what it returns are all pairs closer than the reach, in rising order, whatever
    it was asked before.
    """

    search: Search
    reach: float  # [m]
    _made: tuple[Array, Indices, Indices] | None = None  # positions, and pairs within both

    def pairs(self, x: Array) -> tuple[Indices, Indices]:
        """(k,), (k,) at positions x (m, d)."""
        if not np.isfinite(x).all():  # a run that is lost; whoever runs it will see
            return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
        if self._made is None or self._moved(self._made[0], x):
            i, j = self.search.within(x, (1.0 + _SKIN) * self.reach)
            order = np.lexsort((j, i))
            self._made = x.copy(), i[order], j[order]
        _, i, j = self._made
        squares = np.sum((x[i] - x[j]) ** 2, axis=1)
        near = squares < self.reach**2
        return i[near], j[near]

    def _moved(self, before: Array, x: Array) -> bool:
        # With a little to spare, for rounding.
        largest = 0.49 * _SKIN * self.reach
        return bool(np.max(np.sum((x - before) ** 2, axis=1), initial=0.0) > largest**2)


def _inside(x: Array, other: Array, margin: float) -> Array:
    """Which of x (k, d) are inside the box of `other`, or nearly, (k,)."""
    lower, upper = other.min(axis=0) - margin, other.max(axis=0) + margin
    return np.asarray(np.all((x >= lower) & (x <= upper), axis=1))
