"""Neighbours of moving particles, by cells; a list with a margin serves many steps.

The pairs are those of `solidsph.neighbours`, in the same order and with the same bits, whenever
the list was made: each is tested anew at every step, on the square of its distance as the k-d tree
does. A tree that takes or leaves whole boxes may differ within rounding of the support radius.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any, NamedTuple, final

import attrs
import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solidsph.arrays import Array, Indices
from solidsph.neighbours import Pairs

# The list holds pairs up to this much beyond the support radius. A wider margin lasts longer, but
# in 3D a step tests a third more pairs than there are already.
_MARGIN = 0.1

# Of half the margin, what a particle may move before the list is made anew: the rest is far above
# the rounding of distances.
_SPENT = 0.99

# Cells are this much wider than what is looked for, so that rounding cannot put a neighbour two
# cells away.
_WIDER = 1.001

# With more cells than these for a particle, most of them empty, the k-d tree is the better list.
_MOST_CELLS = 8


class Neighbours(NamedTuple):
    """Ordered pairs in rows, as in `Pairs`, for compiled loops; arrays may be longer than m."""

    starts: Indices  # (n + 1,) row p is starts[p] : starts[p + 1]; the last is m
    own: Indices  # (n,) place of the pair (p, p)
    columns: NDArray[np.int32]  # (m,)
    reverse: Indices  # (m,) place of (q, p) for (p, q)
    distances: Array  # (m,) [m]

    @property
    def count(self) -> int:
        """Number of ordered pairs m."""
        return int(self.starts[-1])

    def pairs(self, positions: Array) -> Pairs:
        """The same for array functions."""
        rows = np.repeat(np.arange(len(positions)), np.diff(self.starts))
        columns = self.columns[: self.count].astype(np.intp)
        return Pairs(
            starts=self.starts,
            rows=rows,
            columns=columns,
            offsets=positions[columns] - positions[rows],
            distances=self.distances[: self.count],
        )


@final
@attrs.define(eq=False)
class NeighbourSearch:
    """Finds neighbours at positions that change little from one call to the next.

    What it keeps between calls saves time and has no influence on what it finds. A particle whose
    position is not finite has no neighbour but itself.
    """

    radius: float  # [m]
    made_at: Array = attrs.field(init=False)  # (n, d) positions of the list below
    # Pairs (p, q) with p < q and less than the margin beyond the radius: q rising, in rows
    starts: Indices = attrs.field(init=False)
    columns: NDArray[np.int32] = attrs.field(init=False)
    _found: Neighbours = attrs.field(init=False)
    _near: NDArray[np.int32] = attrs.field(init=False)
    _distances: Array = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self.made_at = np.empty((0, 0))

    def neighbours(self, positions: Array) -> Neighbours:
        """All pairs at `positions` (n, d); the arrays are overwritten by the next call."""
        d = positions.shape[1]
        loops = search_loops(d)
        stale = positions.shape != self.made_at.shape
        if stale or loops.moved(positions, self.made_at, 0.5 * _SPENT * _MARGIN * self.radius):
            self._make_list(positions)
        loops.test(
            positions,
            self.radius,
            self.starts,
            self.columns,
            self._near,
            self._distances,
            self._found,
        )
        return self._found

    @property
    def bytes(self) -> int:
        """Memory of all arrays."""
        own = (self.made_at, self.starts, self.columns, self._near, self._distances)
        return sum(array.nbytes for array in (*own, *self._found))

    def _make_list(self, positions: Array) -> None:
        n = len(positions)
        self.made_at = positions.copy()
        self.starts, self.columns = candidates(positions, (1.0 + _MARGIN) * self.radius)
        most = len(self.columns)
        if not hasattr(self, "_near") or len(self._found.own) != n or len(self._near) <= most:
            room = most + most // 8 + 1  # so that a list a little longer needs no other arrays
            self._near, self._distances = np.empty(room, np.int32), np.empty(room)
            self._found = Neighbours(
                starts=np.empty(n + 1, np.intp),
                own=np.empty(n, np.intp),
                columns=np.empty(n + 2 * room, np.int32),
                reverse=np.empty(n + 2 * room, np.intp),
                distances=np.empty(n + 2 * room),
            )


def candidates(positions: Array, radius: float) -> tuple[Indices, NDArray[np.int32]]:
    """Pairs p < q no further apart than `radius`: where rows begin (n + 1,), and q rising (k,)."""
    n, d = positions.shape
    finite = np.isfinite(positions).all(axis=1)
    if not finite.any():
        return np.zeros(n + 1, np.intp), np.empty(0, np.int32)
    width = _WIDER * radius
    with np.errstate(over="ignore"):
        low, high = positions[finite].min(axis=0), positions[finite].max(axis=0)
        # A layer of empty cells all round, so that every cell has all its neighbours.
        cells = np.floor((high - low) / width) + 3.0
        few = np.prod(cells) <= _MOST_CELLS * n + 5**d
    if not few:
        return _by_tree(positions, finite, radius)
    strides = np.cumprod([1, *cells[:0:-1]])[::-1].astype(np.intp)
    around = np.array(list(product((-1, 0, 1), repeat=d)), dtype=np.intp) @ strides
    total = int(np.prod(cells))
    return search_loops(d).by_cells(positions, finite, radius, low, width, strides, around, total)


def _by_tree(
    positions: Array, finite: NDArray[np.bool_], radius: float
) -> tuple[Indices, NDArray[np.int32]]:
    place = np.flatnonzero(finite)
    ends = np.sort(cKDTree(positions[finite]).query_pairs(radius, output_type="ndarray"), axis=1)
    p, q = place[ends[:, 0]], place[ends[:, 1]]
    order = np.lexsort((q, p))
    starts = np.searchsorted(p[order], np.arange(len(positions) + 1))
    return starts.astype(np.intp), q[order].astype(np.int32)


class SearchLoops(NamedTuple):
    """Compiled loops of the search."""

    moved: Any  # (positions, made_at, limit) -> whether a particle has moved further
    by_cells: Any  # (positions, finite, radius, low, width, strides, around, total) -> starts, q
    test: Any  # (positions, radius, starts, columns, near, distances, found): found = neighbours


@cache
def search_loops(dimension: int) -> SearchLoops:
    """The loops for one dimension."""
    d = dimension

    @njit
    def square(x, p, y, q):
        # One after the other, as NumPy and the k-d tree add: the bits must be theirs.
        total = 0.0
        for i in range(d):
            apart = y[q, i] - x[p, i]
            total += apart * apart
        return total

    @njit
    def moved(x, made_at, limit):
        for p in range(len(x)):
            if not square(x, p, made_at, p) <= limit * limit:  # not a number has moved too
                return True
        return False

    @njit
    def by_cells(x, finite, radius, low, width, strides, around, total):
        n = len(x)
        cell = np.full(n, -1, np.intp)
        first = np.zeros(total + 2, np.intp)
        for p in range(n):
            if finite[p]:
                cell[p] = 0
                for i in range(d):
                    cell[p] += (1 + np.intp((x[p, i] - low[i]) / width)) * strides[i]
                first[cell[p] + 2] += 1
        for c in range(total):
            first[c + 2] += first[c + 1]
        members = np.empty(first[total + 1], np.intp)  # by cells, rising in each
        for p in range(n):
            if finite[p]:
                members[first[cell[p] + 1]] = p
                first[cell[p] + 1] += 1
        starts = np.zeros(n + 2, np.intp)
        visit(x, radius, cell, first, members, around, starts[2:], np.empty(0, np.int32))
        for p in range(n):
            starts[p + 2] += starts[p + 1]
        columns = np.empty(starts[n + 1], np.int32)
        visit(x, radius, cell, first, members, around, starts[1:], columns)
        return starts[: n + 1], columns

    @njit
    def visit(x, radius, cell, first, members, around, cursor, columns):
        """Count the larger ends of each particle's pairs, or write them at its cursor."""
        for p in range(len(x)):
            if cell[p] < 0:
                continue
            for step in around:
                c = cell[p] + step
                for k in range(first[c], first[c + 1]):
                    q = members[k]
                    if q >= p:
                        break
                    if square(x, p, x, q) <= radius * radius:
                        if len(columns) > 0:
                            columns[cursor[q]] = p
                        cursor[q] += 1

    @njit
    def test(x, radius, starts, columns, near, distances, found):
        n, k = len(x), 0
        own, ends = found.own, found.starts
        own[:] = 0
        for p in range(n):
            for c in range(starts[p], starts[p + 1]):
                q = columns[c]
                apart = square(x, p, x, q)
                # Written in any case and counted if near: nothing to mispredict.
                near[k], distances[k] = q, apart
                inside = np.intp(apart <= radius * radius)
                k += inside
                own[q] += inside
            ends[p + 1] = k
        # Neighbours before p come first in its row, then p, then those after it.
        cursor = np.empty(n, np.intp)
        ends[0] = total = 0
        before = 0
        for p in range(n):
            after = ends[p + 1] - before
            before = ends[p + 1]
            cursor[p] = total
            own[p] += total
            total = own[p] + 1 + after
            ends[p + 1] = total
        # Rows are visited in rising order, so those before q arrive in rising order too.
        k = 0
        for p in range(n):
            here = own[p]
            found.columns[here], found.reverse[here] = p, here
            found.distances[here] = np.sqrt(square(x, p, x, p))  # 0, or not a number
            for here in range(own[p] + 1, ends[p + 1]):
                q, r = near[k], np.sqrt(distances[k])
                back = cursor[q]
                cursor[q] += 1
                found.columns[here], found.reverse[here], found.distances[here] = q, back, r
                found.columns[back], found.reverse[back], found.distances[back] = p, here, r
                k += 1

    return SearchLoops(moved, by_cells, test)
