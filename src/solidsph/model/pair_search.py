"""Search for pairs of particles whose support radii differ.

Two particles are neighbours if they are closer than the mean of their radii. With the largest
radius everywhere a fine part of a body would have as many candidates as its spacing is smaller, to
the power d. So particles are searched class by class: the radii of a class differ by less than 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices

# Radii that differ by rounding are alike.
_ROUNDING = 1e-9


@attrs.frozen(eq=False)
class _Class:
    """Particles with alike radii."""

    numbers: Indices  # (k,) rising
    radii: Array  # (k,) [m]
    tree: cKDTree


@final
@attrs.frozen(eq=False)
class PairSearch:
    """Particles in classes of alike support radii."""

    positions: Array  # (n, d) [m]
    radii: Array  # (n,) [m]
    classes: Sequence[_Class]

    @classmethod
    def of(cls, positions: Array, radii: Array) -> PairSearch:
        """A search among particles at `positions` (n, d) [m] with support `radii` (n,) [m]."""
        return cls(positions, radii, _classes(positions, radii))

    def near(self, rows: Indices) -> tuple[Indices, Indices]:
        """Pairs of each of the particles `rows` (k,) with all that are closer than the mean of the
        two radii, with itself: its place in `rows` and the neighbour, (m,) and (m,), in the order
        of the places and then of the neighbours."""
        n, some = len(self.positions), _classes(self.positions[rows], self.radii[rows])
        keys = [_closer(one, other, n) for one, other in product(some, self.classes)]
        places, columns = np.divmod(np.sort(np.concatenate(keys)), n)
        return places, columns


def _classes(positions: Array, radii: Array) -> list[_Class]:
    """Classes of particles at `positions` (k, d) with these `radii` (k,)."""
    octaves = np.floor(np.log2(radii / radii.min()) + _ROUNDING).astype(np.intp)
    members = [np.flatnonzero(octaves == number) for number in np.unique(octaves)]
    return [_Class(own, radii[own], cKDTree(positions[own])) for own in members]


def _closer(one: _Class, other: _Class, count: int) -> Indices:
    """Pairs of two classes closer than the mean of their radii, p times a `count` plus q, (m,)."""
    reach = 0.5 * (one.radii.max() + other.radii.max())
    found = one.tree.sparse_distance_matrix(other.tree, reach, output_type="ndarray")
    if one.radii.min() + other.radii.min() < 2.0 * reach:
        found = found[found["v"] <= 0.5 * (one.radii[found["i"]] + other.radii[found["j"]])]
    return np.asarray(one.numbers[found["i"]] * count + other.numbers[found["j"]])
