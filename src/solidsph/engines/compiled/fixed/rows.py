"""Compressed rows of weights: particles with the same stencil share it.

On a lattice, long runs of particles p, p + 1, ... have neighbours with the same index offsets and
weights: a run stores one stencil. The other particles have rows of their own; equal rows, such as
those of the first particles of all lines, are stored once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solidsph.engines.compiled.fixed.growing import Growing
from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs, row_starts

# Relative to the largest weight of a row: a weight below the first is rounding, and so is a
# difference of two below the second. Positions on a lattice are rounded to 1e-16 of the body's
# size, so their differences to about 1e-14 of the spacing.
_NOTHING = 1e-15
_SAME = 1e-13

# Number of rows that new rows are compared with. A lattice has as many different rows as there are
# positions within reach of surfaces: about 6 along an axis, some hundreds in all.
_KNOWN = 4096

RUN = 128  # largest block of a run, so that its tensors stay in cache
ROWS = 16  # largest block of particles with rows of their own
BAND = 16  # widest band


class Rows(NamedTuple):
    """Weight vectors g_pq of rows p, laid out for loops over blocks."""

    # (b, 3) blocks of consecutive particles: the first, their number, and their stencil, or -1 - k
    # if they have rows of their own beginning with row k
    blocks: Indices
    members: Indices  # (s + 1,) first member of each stencil
    stencils: Indices  # (s + 1,) first band of each stencil
    offsets: Indices  # (k,) q - p of every member of a stencil, rising
    stencil_weights: Array  # (k, d) [1/m]
    bands: Indices  # (c, 3) members with consecutive offsets: first member, offset, width
    spans: Indices  # (r, 2) begin and end of each own row; several rows may share their members
    row_offsets: NDArray[np.int32]  # (m,) q - p of every member of an own row, rising
    row_weights: Array  # (m, d) [1/m]

    @classmethod
    def of(
        cls,
        blocks: Indices,
        stencils: Sequence[tuple[Indices, Array]],
        spans: Indices,
        row_offsets: NDArray[np.int32],
        row_weights: Array,
    ) -> Rows:
        """Rows of blocks in any order, with the offsets and the weights of each stencil."""
        members = row_starts(np.array([len(own) for own, _ in stencils], dtype=np.intp))
        banded = [_bands(own[0], k) for own, k in zip(stencils, members[:-1], strict=True)]
        weights = [own.astype(row_weights.dtype) for _, own in stencils]
        return cls(
            blocks=np.ascontiguousarray(blocks[np.argsort(blocks[:, 0])]),
            members=members,
            stencils=row_starts(np.array([len(own) for own in banded], dtype=np.intp)),
            offsets=np.concatenate([np.empty(0, dtype=np.intp), *(own for own, _ in stencils)]),
            stencil_weights=np.concatenate([row_weights[:0], *weights]),
            bands=np.concatenate([np.empty((0, 3), dtype=np.intp), *banded]),
            spans=spans,
            row_offsets=row_offsets,
            row_weights=row_weights,
        )

    @property
    def run_particles(self) -> int:
        """Particles that share a stencil."""
        return int(self.blocks[self.blocks[:, 2] >= 0, 1].sum())

    @property
    def run_pairs(self) -> int:
        """Pairs visited by stencils."""
        _, count, where = self.blocks.T
        run = where >= 0
        return int(count[run] @ np.diff(self.members)[where[run]])

    @property
    def row_pairs(self) -> int:
        """Pairs visited by own rows, shared members counted each time."""
        return int((self.spans[:, 1] - self.spans[:, 0]).sum())

    @property
    def row_bytes(self) -> int:
        """Memory of the own rows [bytes]."""
        return self.spans.nbytes + self.row_offsets.nbytes + self.row_weights.nbytes

    @property
    def bytes(self) -> int:
        """Memory of all arrays [bytes]."""
        return sum(array.nbytes for array in self)

    def costs(self) -> Array:
        """Cost of each block, (b,), in pairs of own rows; a pair of a run costs 0.4 of one."""
        _, count, where = self.blocks.T
        costs = np.empty(len(self.blocks))
        run = where >= 0
        sizes = np.diff(self.members)
        costs[run] = 0.4 * count[run] * sizes[where[run]]
        starts = row_starts(self.spans[:, 1] - self.spans[:, 0])
        row = -1 - where[~run]
        costs[~run] = starts[row + count[~run]] - starts[row]
        return costs


class _Compressor:
    """Collects chunks of rows and stores what is new in them."""

    def __init__(self, dimension: int, dtype: str, shortest_run: int) -> None:
        self._shortest_run = shortest_run
        self._stencils: list[tuple[Indices, Array]] = []
        self._blocks = Growing(3, dtype=np.intp)
        self._spans = Growing(2, dtype=np.intp)
        self._offsets = Growing(dtype=np.int32)
        self._weights = Growing(dimension, dtype=dtype)
        self._known = np.zeros((_KNOWN, 2), dtype=np.intp)
        self._row_count = 0

    def add(self, first: int, counts: Indices, columns: Indices, weights: Array) -> None:
        """Add rows `first`, ... with `counts` pairs each (k,), columns (m,) and weights (m, d)."""
        starts = row_starts(counts)
        rows = np.repeat(np.arange(first, first + len(counts)), counts)
        heads = _run_heads(starts, columns - rows, weights, _SAME)
        begin = np.flatnonzero(heads == np.arange(len(heads)))
        length = np.diff([*begin, len(heads)])
        partitioned = length >= self._shortest_run
        for a, n in zip(begin[partitioned], length[partitioned], strict=True):
            own = slice(starts[a], starts[a + 1])
            stencil = self._stencil(columns[own] - (first + a), weights[own])
            parts = -(-n // RUN)
            edges = a + np.arange(parts + 1) * n // parts
            self._add_blocks(first + edges[:-1], np.diff(edges), np.full(parts, stencil))
        single = np.repeat(~partitioned, length)
        self._add_rows(first, single)
        kept = np.repeat(single, counts)
        before = len(self._offsets.so_far())
        self._offsets.extend((columns - rows)[kept])
        self._weights.extend(weights[kept])
        spans, count = _each_once(
            counts[single], before, self._offsets.so_far(), self._weights.so_far(), self._known
        )
        self._offsets.shorten(count)
        self._weights.shorten(count)
        self._spans.extend(spans)
        self._row_count += len(spans)

    def rows(self) -> Rows:
        """All rows added so far; nothing can be added any more."""
        spans, offsets = self._spans.array(), self._offsets.array()
        return Rows.of(self._blocks.array(), self._stencils, spans, offsets, self._weights.array())

    def _stencil(self, offsets: Indices, weights: Array) -> int:
        # Consecutive lines often have the same one.
        if self._stencils:
            last, values = self._stencils[-1]
            if np.array_equal(last, offsets):
                close = _SAME * np.abs(values).max(initial=0.0)
                if np.abs(values - weights).max(initial=0.0) <= close:
                    return len(self._stencils) - 1
        # A copy, because a view would keep the whole chunk alive.
        self._stencils.append((offsets, weights.copy()))
        return len(self._stencils) - 1

    def _add_rows(self, first: int, single: Mask) -> None:
        k = np.flatnonzero(single)
        at, count = stretches(k, ROWS)
        self._add_blocks(first + k[at], count, -1 - (self._row_count + at))

    def _add_blocks(self, first: Indices, count: Indices, where: Indices) -> None:
        self._blocks.extend(np.stack([first, count, where], axis=1))


def compressed(
    chunks: Iterable[tuple[Pairs, Array]], dimension: int, dtype: str, shortest_run: int
) -> Rows:
    """Rows of the weights (m, d) that come with chunks of pairs, in order.

    Args:
        chunks: pairs of consecutive particles, and their weights.
        dimension: d.
        dtype: number type in which the weights are stored.
        shortest_run: smallest number of particles for which a stencil pays.
    """
    compressor = _Compressor(dimension, dtype, shortest_run)
    for pairs, weights in chunks:
        size = np.abs(weights).max(axis=1)
        largest = np.maximum.reduceat(size, pairs.starts[:-1])
        matters = size > _NOTHING * pairs.spread(largest)
        # A particle's own weight makes the row add up to zero, however small it is.
        matters[pairs.self_pairs] = True
        counts = np.add.reduceat(matters, pairs.starts[:-1], dtype=np.intp)
        compressor.add(int(pairs.rows[0]), counts, pairs.columns[matters], weights[matters])
    return compressor.rows()


def compressed_matrix(matrix: csr_array, shortest_run: int) -> Rows:
    """Rows of a matrix (n, n): its entries are weights (m, 1)."""
    compressor = _Compressor(1, matrix.dtype.name, shortest_run)
    matrix.sort_indices()
    counts, columns = np.diff(matrix.indptr), matrix.indices.astype(np.intp)
    compressor.add(0, counts, columns, matrix.data[:, None])
    return compressor.rows()


def stretches(numbers: Indices, longest: int) -> tuple[Indices, Indices]:
    """First place (k,) and length (k,) of stretches of consecutive integers, cut at `longest`."""
    places = np.arange(len(numbers))
    fresh = np.diff(numbers, prepend=numbers[:1] - 2) != 1
    since = places - np.maximum.accumulate(np.where(fresh, places, 0))
    first = np.flatnonzero(since % longest == 0)
    return first, np.diff([*first, len(numbers)])


def _bands(offsets: Indices, start: int) -> Indices:
    """Stretches of consecutive offsets, (c, 3): member from `start` on, offset, width."""
    first, width = stretches(offsets, BAND)
    return np.stack([start + first, offsets[first], width], axis=1).astype(np.intp)


@njit
def _run_heads(starts: Indices, offsets: Indices, weights: Array, tolerance: float) -> Indices:
    """For every row the first row of the run with the same stencil that it belongs to, (k,)."""
    heads = np.empty(len(starts) - 1, np.intp)
    head, largest = -1, 0.0
    for p in range(len(heads)):
        if head < 0 or not _alike(starts, offsets, weights, head, p, tolerance * largest):
            head, largest = p, 0.0
            for m in range(starts[p], starts[p + 1]):
                for k in range(weights.shape[1]):
                    largest = max(largest, abs(weights[m, k]))
        heads[p] = head
    return heads


@njit
def _each_once(
    counts: Indices, first: int, offsets: Indices, weights: Array, known: Indices
) -> tuple[Indices, int]:
    """Begin and end of the members of each new row, (k, 2), and the number of members kept.

    The new rows, with `counts` members each, are in `offsets` and `weights` from `first` on. A row
    that equals one of the `known` rows (h, 2) is dropped, and the others close up.
    """
    spans = np.empty((len(counts), 2), np.intp)
    start = end = first  # of the next row now, and after dropping
    for row in range(len(counts)):
        n = counts[row]
        place = np.intp(n)
        for m in range(start, start + n):
            place = (31 * place + offsets[m]) % len(known)
        a = known[place, 0]
        if known[place, 1] != n or not _same_members(offsets, weights, a, start, n):
            a = end
            # Number by number: assigning rows would compile what broadcasts, and its messages.
            for m in range(n):
                offsets[end + m] = offsets[start + m]
                for k in range(weights.shape[1]):
                    weights[end + m, k] = weights[start + m, k]
            known[place, 0], known[place, 1] = a, n
            end += n
        spans[row, 0], spans[row, 1] = a, a + n
        start += n
    return spans, end


@njit
def _same_members(offsets: Indices, weights: Array, a: int, b: int, count: int) -> bool:
    largest = 0.0
    for m in range(count):
        if offsets[a + m] != offsets[b + m]:
            return False
        for k in range(weights.shape[1]):
            largest = max(largest, abs(weights[a + m, k]))
    for m in range(count):
        for k in range(weights.shape[1]):
            if not abs(weights[a + m, k] - weights[b + m, k]) <= _SAME * largest:
                return False
    return True


@njit
def _alike(starts: Indices, offsets: Indices, weights: Array, p: int, q: int, close: float) -> bool:
    a, b = starts[p], starts[q]
    if starts[p + 1] - a != starts[q + 1] - b:
        return False
    for m in range(starts[p + 1] - a):
        if offsets[a + m] != offsets[b + m]:
            return False
        for k in range(weights.shape[1]):
            if not abs(weights[a + m, k] - weights[b + m, k]) <= close:
                return False
    return True
