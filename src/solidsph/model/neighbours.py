"""Neighbour pairs within the support radius."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.pair_search import PairSearch


@attrs.frozen(eq=False)
class Pairs:
    """Ordered pairs (p, q) in rows: the row of p holds its neighbours q in rising order, with p.

    The list may hold the rows of some particles only; rows and columns are
    numbered among all. In a list of all rows every pair has its reverse.
    """

    starts: Indices  # (n + 1,) the row of the k-th particle listed is starts[k] : starts[k + 1]
    rows: Indices  # (m,) p
    columns: Indices  # (m,) q
    offsets: Array  # (m, d) x_q - x_p [m]
    distances: Array  # (m,) [m]

    @property
    def row_count(self) -> int:
        """Number n of listed rows."""
        return len(self.starts) - 1

    @property
    def count(self) -> int:
        """Number of ordered pairs m, n self pairs included."""
        return len(self.columns)

    def stretch(self, first: int, stop: int) -> Pairs:
        """The rows `first` to `stop` of those listed."""
        own = slice(self.starts[first], self.starts[stop])
        return Pairs(
            starts=self.starts[first : stop + 1] - self.starts[first],
            rows=self.rows[own],
            columns=self.columns[own],
            offsets=self.offsets[own],
            distances=self.distances[own],
        )

    def chosen(self, rows: Indices) -> tuple[Indices, Pairs]:
        """Some of the rows listed, (k,) of 0 to n - 1: where their pairs are, and these alone."""
        counts = np.diff(self.starts)[rows]
        own = ranges(self.starts[rows], counts)
        part = Pairs(
            starts=row_starts(counts),
            rows=self.rows[own],
            columns=self.columns[own],
            offsets=self.offsets[own],
            distances=self.distances[own],
        )
        return own, part

    def reversed_order(self) -> Indices:
        """Index of (q, p) for every pair (p, q), (m,)."""
        # In column order the pairs of column p appear as (q, p) with q rising: row p's order.
        return np.asarray(self.matrix(np.arange(self.count)).tocsc().data, dtype=np.intp)

    def row_sums(self, values: Array) -> Array:
        """Sum of `values` (m, ...) over each particle's pairs, (n, ...)."""
        # Every row holds its self pair, so no segment is empty, as reduceat requires.
        return np.add.reduceat(values, self.starts[:-1], axis=0)

    def spread(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the particles listed (n, ...), repeated for each of their pairs, (m, ...)."""
        return np.repeat(values, np.diff(self.starts), axis=0)

    def of_differences(self, weights: Array) -> Array:
        """The weights (m, d) as they act on f_q - f_p: each row adds up to zero."""
        weights = weights.copy()
        weights[self.self_pairs] = 0.0
        weights[self.self_pairs] = -self.row_sums(weights)
        return weights

    def matrix(self, values: NDArray[Any]) -> csr_array:
        """Sparse n x n matrix with `values` (m,) at (p, q)."""
        n = self.row_count
        return csr_array((values, self.columns, self.starts), shape=(n, n))

    @property
    def self_pairs(self) -> Indices:
        """Indices of the pairs (p, p), (n,)."""
        return np.flatnonzero(self.rows == self.columns)


@attrs.frozen(eq=False)
class Hidden:
    """Pairs of particles that are not neighbours however close, since the body is not between them.

    `visibility.hidden_pairs` finds them in the reference configuration.
    """

    keys: Indices  # (k,) rising: p n + q of every hidden pair, (q, p) as well as (p, q)
    count: int  # number of particles n
    pieces: Indices | None = None  # (n,) the piece of each, if pieces of the body may meet

    def between(self, rows: Indices, columns: Indices) -> Mask:
        """Whether p and q are hidden from each other, for pairs of `rows` and `columns` (m,)."""
        if len(self.keys):
            wanted = np.asarray(rows, dtype=np.intp) * self.count + columns
            places = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
            hidden: Mask = self.keys[places] == wanted
        else:
            hidden = np.zeros(len(rows), dtype=np.bool_)
        if self.pieces is not None:
            hidden |= self.pieces[rows] != self.pieces[columns]
        return hidden

    def part(self, chosen: Indices) -> Hidden:
        """The hidden pairs among the chosen particles (k,), numbered in their order."""
        place = np.full(self.count, -1, dtype=np.intp)
        place[chosen] = np.arange(len(chosen))
        p, q = (place[ends] for ends in np.divmod(self.keys, self.count))
        kept = (p >= 0) & (q >= 0)
        keys = np.sort(p[kept] * len(chosen) + q[kept])
        return Hidden(keys, len(chosen), None if self.pieces is None else self.pieces[chosen])


def neighbour_pairs(positions: Array, radius: Array | float, hidden: Hidden | None = None) -> Pairs:
    """All pairs closer than `radius` [m] among `positions` (n, d), self pairs included, hidden
    pairs excluded. If each particle has its own radius (n,), that of a pair is their mean."""
    n = len(positions)
    if isinstance(radius, np.ndarray):
        rows, columns = PairSearch.of(positions, radius).near(np.arange(n))
        return listed_pairs(positions, rows, columns, n, hidden)
    near = cKDTree(positions).query_pairs(radius, output_type="ndarray")
    if hidden is not None:
        near = near[~hidden.between(near[:, 0], near[:, 1])]
    itself = np.arange(n, dtype=np.intp)
    rows = np.concatenate([near[:, 0], near[:, 1], itself])
    columns = np.concatenate([near[:, 1], near[:, 0], itself])
    # As a sparse matrix, which is sorted row by row.
    there = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n)).tocsr()
    there.sort_indices()
    rows = np.repeat(itself, np.diff(there.indptr))
    columns = there.indices.astype(np.intp)
    offsets = positions[columns] - positions[rows]
    return Pairs(
        starts=there.indptr.astype(np.intp),
        rows=rows,
        columns=columns,
        offsets=offsets,
        distances=np.linalg.norm(offsets, axis=1),
    )


def listed_pairs(
    positions: Array,
    rows: Indices,
    columns: Indices,
    count: int,
    hidden: Hidden | None = None,
    first: int = 0,
) -> Pairs:
    """The pairs of `count` particles from the `first` on, hidden ones excluded.

    Args:
        positions: of all particles (n, d) [m].
        rows: of each pair, counted from the first, rising (m,).
        columns: the neighbours (m,), rising within a row.
        count: number of rows.
        hidden: pairs that are none.
        first: particle of the first row.
    """
    if hidden is not None:
        seen = ~hidden.between(rows + first, columns)
        rows, columns = rows[seen], columns[seen]
    offsets = positions[columns] - positions[rows + first]
    return Pairs(
        starts=np.searchsorted(rows, np.arange(count + 1)).astype(np.intp),
        rows=rows + first,
        columns=columns,
        offsets=offsets,
        distances=np.linalg.norm(offsets, axis=1),
    )


def row_starts(counts: Indices) -> Indices:
    """First entry of each row and the end of the last, (n + 1,), from entries per row (n,)."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)


def ranges(begin: Indices, sizes: Indices) -> Indices:
    """The integers begin, begin + 1, ... of several groups (k,), one group after the other."""
    ends = np.cumsum(sizes)
    return np.asarray(np.repeat(begin - (ends - sizes), sizes) + np.arange(sizes.sum()))
