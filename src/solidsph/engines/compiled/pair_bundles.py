"""Bundles of pairs: consecutive particles whose partners are equally far along, with equal values.

What a pair does to one end it does to the other, opposite or equal, so each pair is there once,
with the particle that comes first. On a lattice nearly all pairs are in full bundles, ends of lines
included, since what a pair has depends on its distance alone.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.fixed.lanes import register_bytes
from solidsph.engines.compiled.jit import njit
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.arrays import Array, Indices

LANES = register_bytes() // 8
"""Consecutive particles of a bundle, of which some may have no such pair."""

_FEWEST = min(3, LANES)  # pairs for which a bundle pays

# Relative to the largest value of its kind, a difference that is rounding: positions on a lattice
# are rounded to 1e-16 of the body's size, so their differences to about 1e-14 of the spacing.
_SAME = 1e-13


class PairBundles(NamedTuple):
    """Pairs (p, q) with p < q, in groups of `LANES` consecutive particles p."""

    starts: Indices  # (g + 1,) bundles of each group
    bundles: NDArray[np.int32]  # (b, 2) q - p, and a bit for every particle with such a pair
    values: Array  # of each pair of a bundle, (b, k) flat
    single_starts: Indices  # (g + 1,) pairs of each group that are in no bundle
    singles: NDArray[np.int32]  # (s, 2) p and q
    single_values: Array  # (s, k) flat

    def reach(self) -> Indices:
        """The end of the particles that each group reaches, (g,)."""
        first = LANES * np.arange(len(self.starts) - 1, dtype=np.intp)
        end = first + LANES
        for starts, last in (
            (self.starts, np.repeat(end, np.diff(self.starts)) + self.bundles[:, 0]),
            (self.single_starts, self.singles[:, 1] + 1),
        ):
            some = np.diff(starts) > 0
            if some.any():
                end[some] = np.maximum(end[some], np.maximum.reduceat(last, starts[:-1][some]))
        return end

    def shares(self, threads: int) -> Indices:
        """The groups divided among threads by their work, (t, 5).

        For each thread: its first group and the end of its groups, the first particle and the end
        of those that they reach, and how many the threads before it reach.
        """
        costs = 1.0 + np.diff(self.starts) + np.diff(self.single_starts)
        done = np.concatenate([[0.0], np.cumsum(costs)])
        edges = np.searchsorted(done, done[-1] * np.arange(threads + 1) / threads)
        reach, shares, size = self.reach(), np.zeros((threads, 5), dtype=np.intp), 0
        for share, (first, end) in enumerate(pairwise(edges.tolist())):
            if first < end:
                low, high = LANES * first, int(reach[first:end].max())
                shares[share] = first, end, low, high, size
                size += high - low
        return shares

    @property
    def padded(self) -> int:
        """Length of a plane of numbers, one a particle, that loops over bundles may overrun."""
        return LANES * len(self.starts)


def pair_bundles(table: PairTable, *, together: bool = True) -> PairBundles:
    """The pairs of a table, in bundles or, if not `together`, all of them single."""
    close = _SAME * np.abs(table.values).max(axis=0, initial=0.0)
    fewest = _FEWEST if together else LANES + 1
    starts, bundles, pairs, single_starts, singles, alone = _bundled(
        table.starts, table.columns, table.values, close, fewest
    )
    own, alone_values = table.values[pairs].ravel(), table.values[alone].ravel()
    return PairBundles(starts, bundles, own, single_starts, singles, alone_values)


def sums_for(shares: Indices, planes: int) -> Array:
    """Room for the sums of every thread, in planes over the particles that it reaches, flat."""
    return np.zeros(planes * int((shares[:, 3] - shares[:, 2]).sum()))


@njit
def _bundled(starts: Any, columns: Any, values: Any, close: Any, fewest: int) -> Any:
    """Bundles, a pair of each, single pairs, and their places in the table."""
    n, most = len(starts) - 1, len(columns) // 2
    groups = (n + LANES - 1) // LANES
    own_starts, alone_starts = np.zeros(groups + 1, np.intp), np.zeros(groups + 1, np.intp)
    bundles, pairs = np.empty((most, 2), np.int32), np.empty(most, np.intp)
    singles, alone = np.empty((most, 2), np.int32), np.empty(most, np.intp)
    count = single_count = 0
    next_of, end_of = np.zeros(LANES, np.intp), np.zeros(LANES, np.intp)
    found = np.zeros(LANES, np.intp)
    for group in range(groups):
        first = group * LANES
        size = min(LANES, n - first)
        for k in range(size):
            next_of[k], end_of[k] = starts[first + k], starts[first + k + 1]
            while next_of[k] < end_of[k] and columns[next_of[k]] <= first + k:
                next_of[k] += 1
        while True:
            # The nearest partners that are left.
            offset, leader = n, -1
            for k in range(size):
                if next_of[k] < end_of[k] and columns[next_of[k]] - (first + k) < offset:
                    offset, leader = columns[next_of[k]] - (first + k), next_of[k]
            if leader < 0:
                break
            bits = together = 0
            for k in range(size):
                m = next_of[k]
                here = m < end_of[k] and columns[m] - (first + k) == offset
                if here and _alike(values, leader, m, close):
                    bits |= 1 << k
                    found[together] = k
                    together += 1
            if together >= fewest:
                bundles[count, 0], bundles[count, 1], pairs[count] = offset, bits, leader
                count += 1
            for i in range(together):
                k, m = found[i], next_of[found[i]]
                if together < fewest:
                    singles[single_count, 0], singles[single_count, 1] = first + k, columns[m]
                    alone[single_count] = m
                    single_count += 1
                next_of[k] = m + 1
        own_starts[group + 1], alone_starts[group + 1] = count, single_count
    return (
        own_starts,
        bundles[:count].copy(),
        pairs[:count].copy(),
        alone_starts,
        singles[:single_count].copy(),
        alone[:single_count].copy(),
    )


@njit
def _alike(values: Any, a: int, b: int, close: Any) -> bool:
    same = True
    for k in range(values.shape[1]):
        same &= abs(values[a, k] - values[b, k]) <= close[k]
    return same
