"""Search for near pairs of particles, only while bounding boxes are close."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.effects._contact_passes import MOVED, NOT_FINITE, change

# Margin of a list of pairs, relative to the reach.
_SKIN = 0.2


class Search(ABC):
    """Pairs between two groups of particles, or within one."""

    @abstractmethod
    def far_apart(self, positions: Array) -> bool:
        """True if no pair can be within reach and margin at positions (n, d) of all particles."""

    @abstractmethod
    def within(self, x: Array, radius: float) -> tuple[Indices, Indices]:
        """Pairs (k,), (k,) at most `radius` apart, each once, in any order.

        Positions x (m, d) and pairs are those of the groups alone, the first before the second.
        """


@final
@attrs.frozen(eq=False)
class Between(Search):
    """Pairs between the particles of two bodies."""

    one: slice | Indices  # particles of the first body, among all
    other: slice | Indices  # particles of the second body
    split: int  # number of particles of the first body
    range: float  # distance of the boxes at which the search begins [m]
    # A cache: the axis to test first, since bodies mostly stay apart along the same axis.
    _first: list[int] = attrs.field(factory=lambda: [0], init=False, repr=False)

    def far_apart(self, positions: Array) -> bool:
        square, d = 0.0, positions.shape[1]
        for axis in sorted(range(d), key=lambda k: k != self._first[0]):
            x, y = positions[self.one, axis], positions[self.other, axis]
            gap = max(0.0, float(x.min() - y.max()), float(y.min() - x.max()))
            square += gap**2
            if square > self.range**2:
                self._first[0] = axis
                return True
        return False

    def within(self, x: Array, radius: float) -> tuple[Indices, Indices]:
        one = np.arange(self.split)
        other = np.arange(self.split, len(x))
        # All particles inside the other box, however deep: interiors can touch, too.
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
    """Pairs of particles of one body that were far from each other."""

    particles: Indices  # (m,) among all particles
    reference: Array  # X, (m, d) [m]
    apart: float  # smallest distance of a pair in the reference configuration [m]
    range: float  # largest distance of a pair now [m]

    def far_apart(self, positions: Array) -> bool:
        # No two displacements differ by more than the diagonal of the box that holds them all.
        u = positions[self.particles] - self.reference
        return bool(np.linalg.norm(np.ptp(u, axis=0)) < self.apart - self.range)

    def within(self, x: Array, radius: float) -> tuple[Indices, Indices]:
        found = cKDTree(x).query_pairs(radius, output_type="ndarray")
        i, j = found[:, 0], found[:, 1]
        X = self.reference
        far = np.sum((X[i] - X[j]) ** 2, axis=1) > self.apart**2
        return i[far], j[far]


@attrs.define(eq=False)
class NeighbourList:
    """All pairs closer than a reach, in ascending order, among some that are a little further.

    The search is repeated only when particles have moved by half the margin.
    """

    search: Search
    reach: float  # [m]
    _made: tuple[Array, Indices, Indices] | None = None  # positions, and pairs within both

    def pairs(self, x: Array) -> tuple[Indices, Indices]:
        """Pairs (k,), (k,) at positions x (m, d) [m]; none if one is not finite."""
        if self._made is None:
            changed = MOVED if np.isfinite(x).all() else NOT_FINITE
        else:
            # A little less than half, for rounding.
            changed = change(self._made[0], x, 0.49 * _SKIN * self.reach)
        if changed == NOT_FINITE:  # the run has diverged and is stopped elsewhere
            return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
        if changed == MOVED or self._made is None:
            i, j = self.search.within(x, (1.0 + _SKIN) * self.reach)
            order = np.lexsort((j, i))
            self._made = x.copy(), i[order], j[order]
        _, i, j = self._made
        return i, j


def _inside(x: Array, other: Array, margin: float) -> Array:
    """True for points x (k, d) inside the box of `other` plus a margin, (k,)."""
    lower, upper = other.min(axis=0) - margin, other.max(axis=0) + margin
    return np.asarray(np.all((x >= lower) & (x <= upper), axis=1))


def together(particles: Indices) -> slice | Indices:
    """The particles (k,), as a slice if they are consecutive, which then takes no copies."""
    first, count = int(particles[0]), len(particles)
    whole = slice(first, first + count)
    return whole if np.array_equal(particles, np.arange(first, first + count)) else particles
