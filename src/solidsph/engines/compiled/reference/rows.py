"""Rows of weights in little memory: particles with the same stencil share it.

Particles made by a lattice stand in long runs p, p + 1, ... whose neighbours have the same index
offsets and the same weights. A run keeps one stencil. The rest is treated row by row, but there too
many have the row of another, as the first particles of all lines do: each row is kept once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from solidsph.engines.compiled.reference.growing import Growing
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs

# Relative to the largest weight of a row: below the first a weight is rounding, and below the
# second so is the difference of two. Positions of a lattice are rounded to 1e-16 of the body's
# size, so their differences to some 1e-14 of the spacing.
_NOTHING = 1e-15
_SAME = 1e-13

# How many rows are remembered to be compared with those that come. A lattice has as many different
# ones as there are places within reach of surfaces: some 6 along an axis, some hundreds in all.
_KNOWN = 4096

RUN = 128  # most particles of a run that are treated at once, so that their tensors stay in cache
ROWS = 16  # the same for rows, which have weights of their own
BAND = 16  # widest band


class Rows(NamedTuple):
    """Weight vectors g_pq of rows p, laid out for the loops over them."""

    # (b, 3) consecutive particles that are treated at once: the first, how many, and the number
    # of their stencil, or -1 - k where their own rows begin with row k
    blocks: Indices
    # (s + 1,), (s + 1,) where each stencil's members, and its bands, begin
    members: Indices
    stencils: Indices
    offsets: Indices  # (k,) q - p of every member of a stencil, rising
    stencil_weights: Array  # (k, d) [1/m]
    bands: Indices  # (c, 3) members whose offsets follow each other: first member, offset, width
    # (r, 2), (m,), (m, d) rows of those that are in no run: where the members of each begin and
    # end, their q - p, rising, and their weights [1/m]; several may have the same members
    spans: Indices
    row_offsets: NDArray[np.int32]
    row_weights: Array

    @property
    def run_particles(self) -> int:
        """Particles that share a stencil."""
        return int(self.blocks[self.blocks[:, 2] >= 0, 1].sum())

    @property
    def run_pairs(self) -> int:
        """Pairs that are visited by stencils."""
        _, count, where = self.blocks.T
        run = where >= 0
        return int(count[run] @ np.diff(self.members)[where[run]])

    @property
    def row_pairs(self) -> int:
        """Pairs that are visited by rows, those of members that several share each time."""
        return int((self.spans[:, 1] - self.spans[:, 0]).sum())

    @property
    def row_bytes(self) -> int:
        """Memory of what belongs to rows alone."""
        return self.spans.nbytes + self.row_offsets.nbytes + self.row_weights.nbytes

    @property
    def bytes(self) -> int:
        """Memory of all arrays."""
        return sum(array.nbytes for array in self)

    def costs(self) -> Array:
        """Pairs of each block, those of a run counted by what they cost beside a row's, (b,)."""
        _, count, where = self.blocks.T
        costs = np.empty(len(self.blocks))
        run = where >= 0
        sizes = np.diff(self.members)
        costs[run] = 0.4 * count[run] * sizes[where[run]]
        starts = starts_of(self.spans[:, 1] - self.spans[:, 0])
        row = -1 - where[~run]
        costs[~run] = starts[row + count[~run]] - starts[row]
        return costs


class _Compressor:
    """Takes chunks of rows and keeps what is new in them."""

    def __init__(self, dimension: int, dtype: str, shortest_run: int) -> None:
        self._dtype, self._shortest_run = dtype, shortest_run
        self._stencils: list[tuple[Indices, Array]] = []
        self._blocks = Growing(3, dtype=np.intp)
        self._spans = Growing(2, dtype=np.intp)
        self._offsets = Growing(dtype=np.int32)
        self._weights = Growing(dimension, dtype=dtype)
        self._known = np.zeros((_KNOWN, 2), dtype=np.intp)
        self._row_count = 0

    def add(self, first: int, counts: Indices, columns: Indices, weights: Array) -> None:
        """Rows `first`, ... with so many pairs each (k,), columns (m,) and weights (m, d)."""
        starts = np.concatenate([[0], np.cumsum(counts)])
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
        """All that was added."""
        blocks = self._blocks.array()
        offsets = [one[0] for one in self._stencils]
        members = starts_of(np.array([len(one) for one in offsets], dtype=np.intp))
        banded = [bands(one, start) for one, start in zip(offsets, members[:-1], strict=True)]
        weights = self._weights.array()
        stencil_weights = [one[1].astype(self._dtype) for one in self._stencils]
        return Rows(
            blocks=np.ascontiguousarray(blocks[np.argsort(blocks[:, 0])]),
            members=members,
            stencils=starts_of(np.array([len(one) for one in banded], dtype=np.intp)),
            offsets=np.concatenate([np.empty(0, dtype=np.intp), *offsets]),
            stencil_weights=np.concatenate([weights[:0], *stencil_weights]),
            bands=np.concatenate([np.empty((0, 3), dtype=np.intp), *banded]),
            spans=self._spans.array(),
            row_offsets=self._offsets.array(),
            row_weights=weights,
        )

    def _stencil(self, offsets: Indices, weights: Array) -> int:
        # Lines that follow each other often have the same one.
        if self._stencils:
            last, values = self._stencils[-1]
            if np.array_equal(last, offsets):
                close = _SAME * np.abs(values).max()
                if np.abs(values - weights).max() <= close:
                    return len(self._stencils) - 1
        # A copy: what comes in is a view of a whole chunk, which would live as long.
        self._stencils.append((offsets, weights.copy()))
        return len(self._stencils) - 1

    def _add_rows(self, first: int, single: Mask) -> None:
        k = np.flatnonzero(single)
        # A block ends where the particles do not follow each other, or where it is full.
        fresh = np.diff(k, prepend=-2) != 1
        since = np.arange(len(k)) - np.maximum.accumulate(np.where(fresh, np.arange(len(k)), 0))
        at = np.flatnonzero(since % ROWS == 0)
        self._add_blocks(first + k[at], np.diff([*at, len(k)]), -1 - (self._row_count + at))

    def _add_blocks(self, first: Indices, count: Indices, where: Indices) -> None:
        self._blocks.extend(np.stack([first, count, where], axis=1))


def compressed(
    chunks: Iterable[tuple[Pairs, Array]], dimension: int, dtype: str, shortest_run: int
) -> Rows:
    """Rows of the weights (m, d) that come with chunks of pairs, in order.

    Args:
        chunks: pairs of consecutive particles, and their weights.
        dimension: d.
        dtype: number type in which the weights are kept.
        shortest_run: fewest particles for which a stencil pays.
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


def in_chunks(pairs: Pairs, weights: Array, rows: int = 2048) -> Iterator[tuple[Pairs, Array]]:
    """A whole list of pairs and its weights (m, d), some rows at a time."""
    for first in range(0, pairs.row_count, rows):
        starts = pairs.starts[first : first + rows + 1]
        own = slice(starts[0], starts[-1])
        part = Pairs(
            starts=starts - starts[0],
            rows=pairs.rows[own],
            columns=pairs.columns[own],
            offsets=pairs.offsets[own],
            distances=pairs.distances[own],
        )
        yield part, weights[own]


def starts_of(lengths: Indices) -> Indices:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.intp)


def bands(offsets: Indices, start: int) -> Indices:
    """Stretches of offsets that follow each other, (c, 3): first member, offset, width.

    `start` is the first member of all.
    """
    fresh = np.diff(offsets, prepend=offsets[:1] - 2) != 1
    since = np.arange(len(offsets))
    since = since - np.maximum.accumulate(np.where(fresh, since, 0))
    first = np.flatnonzero(since % BAND == 0)
    width = np.diff([*first, len(offsets)])
    return np.stack([start + first, offsets[first], width], axis=1).astype(np.intp)


@njit
def _run_heads(starts: Indices, offsets: Indices, weights: Array, tolerance: float) -> Indices:
    """For every row the first of those before it, without a gap, that have its stencil, (k,)."""
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
    """Where the members of each new row begin and end, (k, 2), and how many members are kept.

    The new rows, of so many members each, stand in `offsets` and `weights` from `first` on. What
    one of the `known` rows (h, 2) says already is dropped, and the others close up.
    """
    spans = np.empty((len(counts), 2), np.intp)
    start = end = first  # where the next row stands, and where it is to go
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
