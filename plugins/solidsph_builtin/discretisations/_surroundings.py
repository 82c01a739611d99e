"""Points that see the same particles of a lattice around them.

What depends on the particles around a point only, such as a fit to their values, is the same at
all of them, and needs to be computed at one.
"""

from __future__ import annotations

from itertools import product

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.discretisations._grid import Grid

# Places closer than this part of a cell are the same.
_SAME = 1e-6


@attrs.frozen(eq=False)
class Surroundings:
    """The particles of a lattice in an array with the shape of the lattice and a margin."""

    grid: Grid
    numbers: Indices  # (size,) of the particle at each lattice point, -1 for none
    shape: tuple[int, ...]  # of the array
    around: int  # lattice points on each side of a cell that count
    scattered: cKDTree | None  # the particles that are not at a lattice point

    @classmethod
    def of(cls, positions: Array, grid: Grid, around: int) -> Surroundings:
        """Of particles at `positions` (n, d) [m].

        What is computed must not reach further than `around` lattice points on each side of a cell.
        """
        places = (positions - grid.lower) / grid.steps - grid.first
        index = np.rint(places).astype(np.intp)
        at = (np.abs(places - index) <= _SAME).all(axis=1)
        at &= ((index >= 0) & (index < np.array(grid.counts))).all(axis=1)
        shape = tuple(count + 2 * around for count in grid.counts)
        numbers = np.full(np.prod(shape), -1, dtype=np.intp)
        numbers[np.ravel_multi_index(tuple(index[at].T + around), shape)] = np.flatnonzero(at)
        off = positions[~at]
        return cls(grid, numbers, shape, around, cKDTree(off) if len(off) else None)

    def regular(self, points: Array, reach: float) -> Mask:
        """Which of `points` (m, d) have particles of the lattice only within `reach` [m], (m,)."""
        index = self._cells(points)[0]
        inside = ((index >= 0) & (index + 1 < np.array(self.grid.counts))).all(axis=1)
        if self.scattered is not None:
            gaps = self.scattered.query(points, distance_upper_bound=1.01 * reach)[0]
            inside &= np.asarray(gaps) > reach
        return np.asarray(inside, dtype=np.bool_)

    def kinds(self, points: Array) -> tuple[Indices, Indices]:
        """Which of regular `points` (m, d) are the first of their kind (k,), and the kind of each
        (m,): points of a kind have the same place in their cell, and particles at the same places
        around it."""
        index, within = self._cells(points)
        home = self.home(points)
        steps = list(product(range(1 - self.around, 1 + self.around), repeat=index.shape[1]))
        bits = np.zeros((len(points), -(-len(steps) // 64)), dtype=np.uint64)
        for number, step in enumerate(steps):
            word, bit = divmod(number, 64)
            there = self.numbers[home + np.array(step) @ self._strides] >= 0
            bits[:, word] |= there.astype(np.uint64) << np.uint64(bit)
        # Below 2^21 each, so that one number tells the place in the cell.
        places = np.rint(within / _SAME).astype(np.int64) @ (1 << 21 * np.arange(within.shape[1]))
        keys = np.column_stack([bits.view(np.int64), places])
        # Most points are among complete rows, and need no comparison of whole keys.
        whole = (bits == bits.max(axis=0)).all(axis=1)
        first, kind = np.empty(0, dtype=np.intp), np.empty(len(points), dtype=np.intp)
        for some, own in ((np.flatnonzero(whole), places), (np.flatnonzero(~whole), keys)):
            _, at, which = np.unique(own[some], axis=0, return_index=True, return_inverse=True)
            kind[some] = len(first) + which.ravel()
            first = np.concatenate([first, some[at]])
        return first, kind

    def home(self, points: Array) -> Indices:
        """Place in the array of the lower corner of the cell of each point, (m,)."""
        index = self._cells(points)[0]
        home: Indices = (index + self.around) @ self._strides
        return home

    def places(self, particles: Array) -> Indices:
        """Place in the array of lattice points at positions (m, d), (m,)."""
        index = np.rint((particles - self.grid.lower) / self.grid.steps - self.grid.first)
        places: Indices = (index.astype(np.intp) + self.around) @ self._strides
        return places

    @property
    def _strides(self) -> Indices:
        return np.cumprod([1, *self.shape[:0:-1]], dtype=np.intp)[::-1]

    def _cells(self, points: Array) -> tuple[Indices, Array]:
        """Lower corner of the cell of each point, and the place in the cell, both (m, d)."""
        places = (points - self.grid.lower) / self.grid.steps - self.grid.first
        # On a face of the lattice a point is in the cell before it.
        index = np.clip(np.floor(places).astype(np.intp), 0, np.array(self.grid.counts) - 2)
        return index, places - index
