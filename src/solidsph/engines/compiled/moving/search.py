"""Near pairs of moving particles by a cell list with a margin, which serves many steps.

The pairs are those of `solidsph.model.neighbours`, in the same order and with the same bits,
whenever the list was made: each is tested at every step, by its squared distance as in the k-d
tree. A tree that accepts or rejects whole boxes may differ within rounding of the support radius.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any, NamedTuple, final

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Hidden

# Margin of the list over the support radius. A wider one lasts longer, but in 3D a step already
# tests a third more pairs than there are.
_MARGIN = 0.1

# Part of half the margin that a particle may move before the list is made again; the rest is far
# above the rounding of distances.
_SPENT = 0.99

# Width of the cells over the search radius, so that rounding cannot put a neighbour two cells away.
_WIDER = 1.001

# Cells per particle, most of them empty, beyond which the k-d tree is better.
_MOST_CELLS = 8

# Coordinates from which on squares may overflow, which count as infinite [m].
_FURTHEST = 1e150


class Near(NamedTuple):
    """Pairs p < q in rows of p, with q rising. Arrays may be longer than k."""

    starts: Indices  # (n + 1,) those of p are starts[p] : starts[p + 1]; the last is k
    columns: NDArray[np.int32]  # (k,) q
    distances: Array  # (k,) [m]

    @property
    def pair_count(self) -> int:
        """Number of pairs k."""
        return int(self.starts[-1])


@final
@attrs.define(eq=False)
class NeighbourSearch:
    """Search for neighbours at positions that change little from one call to the next.

    What it keeps between calls does not influence the result. A particle whose position is not
    finite has no neighbours.
    """

    radius: float  # [m]
    hidden: Hidden | None = None  # near particles that are not neighbours
    _list_at: Array = attrs.field(init=False)  # (n, d) positions of the list
    _list: Near = attrs.field(init=False)  # pairs up to the margin beyond the radius
    _near: Near = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self._list_at = np.empty((0, 0))
        none = np.empty(0, np.int32)
        self._list = self._near = Near(np.zeros(1, np.intp), none, np.empty(0))

    def near(self, positions: Array) -> Near:
        """All pairs at `positions` (n, d); the next call overwrites the arrays."""
        loops = search_loops(positions.shape[1])
        stale = positions.shape != self._list_at.shape
        if stale or loops.moved(positions, self._list_at, 0.5 * _SPENT * _MARGIN * self.radius):
            self._make_list(positions)
        loops.test(positions, self.radius, self._list, self._near)
        return self._near

    @property
    def list_origin(self) -> Array:
        """Positions at which the current list was made, (n, d)."""
        return self._list_at

    @property
    def bytes(self) -> int:
        """Memory of all arrays."""
        return self._list_at.nbytes + sum(array.nbytes for array in (*self._list, *self._near))

    def _make_list(self, positions: Array) -> None:
        n = len(positions)
        self._list_at = positions.copy()
        starts, columns = candidates(positions, (1.0 + _MARGIN) * self.radius)
        if self.hidden is not None:
            rows = np.repeat(np.arange(n), np.diff(starts))
            seen = ~self.hidden.between(rows, columns.astype(np.intp))
            starts = np.concatenate([[0], np.cumsum(seen)])[starts]
            columns = columns[seen]
        self._list = Near(starts, columns, np.empty(0))  # distances are computed at each step
        most = len(columns) + 1  # the loop writes a pair before it knows whether it counts
        if len(self._near.starts) != n + 1 or len(self._near.columns) < most:
            room = most + most // 8  # so that a list a little longer needs no other arrays
            self._near = Near(np.empty(n + 1, np.intp), np.empty(room, np.int32), np.empty(room))


def candidates(positions: Array, radius: float) -> tuple[Indices, NDArray[np.int32]]:
    """Pairs p < q at most `radius` apart: starts of rows (n + 1,), and q (k,), rising in each."""
    n, d = positions.shape
    finite: Mask = np.all(np.abs(positions) < _FURTHEST, axis=1)
    if not finite.any():
        return np.zeros(n + 1, np.intp), np.empty(0, np.int32)
    width = _WIDER * radius
    low, high = positions[finite].min(axis=0), positions[finite].max(axis=0)
    # With a layer of empty cells around, so that every cell has all its neighbours.
    cells = np.floor((high - low) / width) + 3.0
    with np.errstate(over="ignore"):
        few = np.prod(cells) <= _MOST_CELLS * n + 5**d
    if not few:
        return _by_tree(positions, finite, radius)
    strides = np.cumprod([1, *cells[:0:-1]])[::-1].astype(np.intp)
    around = np.array(list(product((-1, 0, 1), repeat=d)), dtype=np.intp) @ strides
    total = int(np.prod(cells))
    starts, columns = search_loops(d).by_cells(
        positions, finite, radius, low, width, strides, around, total
    )
    return starts, columns


def _by_tree(positions: Array, finite: Mask, radius: float) -> tuple[Indices, NDArray[np.int32]]:
    place = np.flatnonzero(finite)
    ends = np.sort(cKDTree(positions[finite]).query_pairs(radius, output_type="ndarray"), axis=1)
    p, q = place[ends[:, 0]], place[ends[:, 1]]
    order = np.lexsort((q, p))
    starts = np.searchsorted(p[order], np.arange(len(positions) + 1))
    return starts.astype(np.intp), q[order].astype(np.int32)


class SearchLoops(NamedTuple):
    """Compiled loops of the search."""

    moved: Any  # (positions, list_at, limit) -> True if a particle has moved further
    by_cells: Any  # (positions, finite, radius, low, width, strides, around, total) -> starts, q
    test: Any  # (positions, radius, list, found): found = those of the list within the radius


@cache
def search_loops(dimension: int) -> SearchLoops:
    """The loops for one dimension."""
    d = dimension

    @njit
    def square(x, p, y, q):
        # In the order of NumPy and of the k-d tree, for the same bits.
        total = 0.0
        for i in range(d):
            apart = y[q, i] - x[p, i]
            total += apart * apart
        return total

    @njit
    def moved(x, list_at, limit):
        for p in range(len(x)):
            if square(x, p, list_at, p) <= limit * limit:
                continue
            return True  # also if it is not a number
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
    def test(x, radius, listed, found):
        k = 0
        found.starts[0] = 0
        for p in range(len(x)):
            for c in range(listed.starts[p], listed.starts[p + 1]):
                q = listed.columns[c]
                apart = square(x, p, x, q)
                # Written in any case and counted if near, without a branch.
                found.columns[k], found.distances[k] = q, np.sqrt(apart)
                k += int(apart <= radius * radius)
            found.starts[p + 1] = k

    return SearchLoops(moved, by_cells, test)
