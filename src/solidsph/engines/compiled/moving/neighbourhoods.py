"""Neighbours of moving particles, in rows for loops over the neighbours of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.moving.search import Near
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import Pairs


class Neighbourhoods(NamedTuple):
    """Ordered pairs in rows, as in `Pairs`, self pairs included. Arrays may be longer than m."""

    starts: Indices  # (n + 1,) row p is starts[p] : starts[p + 1]; the last is m
    own: Indices  # (n,) place of (p, p)
    columns: NDArray[np.int32]  # (m,) q
    slopes: Array  # (m,) W'(r) / r, 0 for (p, p) [m^-(d+2)]

    @property
    def pair_count(self) -> int:
        """Number of ordered pairs m."""
        return int(self.starts[-1])

    @classmethod
    def with_room(cls, particles: int, pairs: int) -> Neighbourhoods:
        """Arrays for these numbers of particles and of near pairs p < q, to be filled."""
        m = particles + 2 * pairs
        return cls(
            np.empty(particles + 1, np.intp),
            np.empty(particles, np.intp),
            np.empty(m, np.int32),
            np.empty(m),
        )

    def pairs(self, positions: Array) -> Pairs:
        """The pairs for functions of arrays."""
        rows = np.repeat(np.arange(len(positions)), np.diff(self.starts))
        columns = self.columns[: self.pair_count].astype(np.intp)
        with np.errstate(all="ignore"):  # a position may not be finite
            offsets = positions[columns] - positions[rows]
        return Pairs(
            starts=self.starts,
            rows=rows,
            columns=columns,
            offsets=offsets,
            distances=np.linalg.norm(offsets, axis=1),
        )


class Place(NamedTuple):
    """Everything that the current positions determine."""

    rows: Neighbourhoods
    positions: Array  # (n, d) x [m]
    cells: Array  # (n,) weights in sums over neighbours [m^d]
    volumes: Array  # (n,) [m^d]


@njit
def fill(near: Near, slopes: Array, rows: Neighbourhoods) -> None:
    """Fill `rows` with both directions of the near pairs and with the self pairs."""
    n = len(rows.own)
    rows.own[:] = 0
    for k in range(near.starts[n]):
        rows.own[near.columns[k]] += 1  # neighbours before q, which come first in its row
    cursor = np.empty(n, np.intp)
    rows.starts[0] = 0
    for p in range(n):
        cursor[p] = rows.starts[p]
        rows.own[p] += rows.starts[p]
        rows.starts[p + 1] = rows.own[p] + 1 + near.starts[p + 1] - near.starts[p]
    # Rows are visited in ascending order, so neighbours before q come in that order too.
    for p in range(n):
        here = rows.own[p]
        rows.columns[here], rows.slopes[here] = p, 0.0
        for k in range(near.starts[p], near.starts[p + 1]):
            here += 1
            q = near.columns[k]
            there = cursor[q]
            cursor[q] += 1
            rows.columns[here], rows.slopes[here] = q, slopes[k]
            rows.columns[there], rows.slopes[there] = p, slopes[k]


@njit
def kernel_sums(near: Near, values: Array, own_value: float, cells: Array, sums: Array) -> None:
    """Fill `sums` (n,) with the sums over neighbours of W_pq times reference cells [-]."""
    sums[:] = own_value * cells
    for p in range(len(sums)):
        total = 0.0
        for k in range(near.starts[p], near.starts[p + 1]):
            q = near.columns[k]
            total += values[k] * cells[q]
            sums[q] += values[k] * cells[p]
        sums[p] += total
