"""Search for near pairs of particles, only while bounding boxes are close."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from itertools import combinations, product
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.effects._contact_passes import MOVED, NOT_FINITE, change

# Margin of a list of pairs, relative to the least reach.
_SKIN = 0.2

# Smallest initial distance of particles of one body that may touch, in reaches.
_APART = 2.0

# Radii that differ by rounding are alike.
_ROUNDING = 1e-9


class Search(ABC):
    """Pairs between two groups of particles, or within one.

    The reach of a pair is the larger radius of its two particles.
    """

    radii: Array  # (m,) of the particles of the groups [m]

    @abstractmethod
    def far_apart(self, positions: Array) -> bool:
        """True if no pair can be within reach and margin at positions (n, d) of all particles."""

    @abstractmethod
    def within(self, x: Array, margin: float) -> tuple[Indices, Indices]:
        """Pairs (k,), (k,) at most their reach and a `margin` [m] apart, each once, in any order.

        Positions x (m, d) and pairs are those of the groups alone, the first before the second.
        """


@final
@attrs.frozen(eq=False)
class Between(Search):
    """Pairs between the particles of two bodies."""

    one: slice | Indices  # particles of the first body, among all
    other: slice | Indices  # particles of the second body
    split: int  # number of particles of the first body
    radii: Array  # (m,) [m]
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

    def within(self, x: Array, margin: float) -> tuple[Indices, Indices]:
        one = np.arange(self.split)
        other = np.arange(self.split, len(x))
        furthest = float(self.radii.max()) + margin
        # All particles inside the other box, however deep: interiors can touch, too.
        one = one[_inside(x[one], x[other], furthest)]
        other = other[_inside(x[other], x[one], furthest)] if one.size else other[:0]
        if not other.size:
            return one[:0], other
        pairs = product(_classes(x, self.radii, one), _classes(x, self.radii, other))
        i, j = np.concatenate([a.near(b, margin) for a, b in pairs], axis=1)
        return i, j


@final
@attrs.frozen(eq=False)
class Within(Search):
    """Pairs of particles of one body that were far from each other."""

    particles: Indices  # (m,) among all particles
    reference: Array  # X, (m, d) [m]
    radii: Array  # (m,) [m]
    margin: float  # beyond its reach at which a pair is looked for [m]

    def far_apart(self, positions: Array) -> bool:
        # No two displacements differ by more than the diagonal of the box that holds them all.
        u = positions[self.particles] - self.reference
        nearest = (_APART - 1.0) * float(self.radii.min()) - self.margin
        return bool(np.linalg.norm(np.ptp(u, axis=0)) < nearest)

    def within(self, x: Array, margin: float) -> tuple[Indices, Indices]:
        classes = _classes(x, self.radii, np.arange(len(x)))
        found = [one.inside(margin) for one in classes]
        found += [one.near(other, margin) for one, other in combinations(classes, 2)]
        i, j = np.concatenate(found, axis=1)
        X = self.reference
        apart = _APART * np.maximum(self.radii[i], self.radii[j])
        far = np.sum((X[i] - X[j]) ** 2, axis=1) > apart**2
        return np.minimum(i, j)[far], np.maximum(i, j)[far]


@attrs.frozen(eq=False)
class _Class:
    """Particles whose radii differ by less than a factor of 2."""

    numbers: Indices  # (k,)
    radii: Array  # (k,) [m]
    tree: cKDTree

    def near(self, other: _Class, margin: float) -> Indices:
        """Pairs with those of another class, (2, k)."""
        reach = max(float(self.radii.max()), float(other.radii.max())) + margin
        found = self.tree.sparse_distance_matrix(other.tree, reach, output_type="ndarray")
        i, j = found["i"], found["j"]
        own = found["v"] <= np.maximum(self.radii[i], other.radii[j]) + margin
        return np.stack([self.numbers[i[own]], other.numbers[j[own]]])

    def inside(self, margin: float) -> Indices:
        """Pairs within the class, (2, k)."""
        found = self.tree.query_pairs(float(self.radii.max()) + margin, output_type="ndarray")
        return np.asarray(self.numbers[found.T])


def _classes(x: Array, radii: Array, own: Indices) -> list[_Class]:
    """Those of the particles `own` (k,) at x (m, d)."""
    mine = radii[own]
    octaves = np.floor(np.log2(mine / mine.min()) + _ROUNDING)
    members = [own[octaves == number] for number in np.unique(octaves)]
    return [_Class(part, radii[part], cKDTree(x[part])) for part in members]


Bring = Callable[[Indices, Indices, Array], tuple[Array, ...]]
"""What pairs i, j with their reaches bring to the room of both, each (k,)."""


@attrs.frozen(eq=False)
class Candidates:
    """Pairs that may be within reach, and what of them stays as it is."""

    i: Indices  # (k,)
    j: Indices  # (k,)
    reaches: Array  # (k,) [m]
    brought: tuple[Array, ...]  # to the room of both, each (k,)


def candidates(search: Search, bring: Bring, x: Array, margin: float = 0.0) -> Candidates:
    """Pairs at positions x (m, d) up to a `margin` beyond their reach [m], in ascending order."""
    i, j = search.within(x, margin)
    order = np.lexsort((j, i))
    i, j = i[order], j[order]
    reaches = np.maximum(search.radii[i], search.radii[j])
    return Candidates(i, j, reaches, bring(i, j, reaches))


@attrs.define(eq=False)
class NeighbourList:
    """All pairs within reach, among some that are a little further.

    The search is repeated only when particles have moved by half the margin.
    """

    search: Search
    bring: Bring
    _made: tuple[Array, Candidates] | None = None  # positions, and pairs within reach and margin

    def candidates(self, x: Array) -> Candidates:
        """Pairs at positions x (m, d) [m]; none if one is not finite."""
        margin = _SKIN * float(self.search.radii.min())
        if self._made is None:
            changed = MOVED if np.isfinite(x).all() else NOT_FINITE
        else:
            # A little less than half, for rounding.
            changed = change(self._made[0], x, 0.49 * margin)
        if changed == NOT_FINITE:  # the run has diverged and is stopped elsewhere
            none = np.empty(0, dtype=np.intp)
            return Candidates(none, none, np.empty(0), self.bring(none, none, np.empty(0)))
        if changed == MOVED or self._made is None:
            self._made = x.copy(), candidates(self.search, self.bring, x, margin)
        return self._made[1]


def _inside(x: Array, other: Array, margin: float) -> Array:
    """True for points x (k, d) inside the box of `other` plus a margin, (k,)."""
    lower, upper = other.min(axis=0) - margin, other.max(axis=0) + margin
    return np.asarray(np.all((x >= lower) & (x <= upper), axis=1))


def together(particles: Indices) -> slice | Indices:
    """The particles (k,), as a slice if they are consecutive, which then takes no copies."""
    first, count = int(particles[0]), len(particles)
    whole = slice(first, first + count)
    return whole if np.array_equal(particles, np.arange(first, first + count)) else particles
