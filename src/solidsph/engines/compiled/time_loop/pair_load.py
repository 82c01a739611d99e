"""Forces of pairs in the compiled loop.

On a lattice, runs of consecutive particles have the same neighbours and values, as they have the
same weights (`fixed/rows.py`). Their forces are summed for many particles at a time: one number of
every vector stands beside that of the next particle, so that the loop over a run is vectorised.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import prange
from numba.np.unsafe.ndarray import to_fixed_tuple

from solidsph.engines.compiled.fixed.rows import RUN, Rows, rows_of
from solidsph.engines.compiled.jit import njit
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.arrays import Array, Indices

_SHORTEST_RUN = 8  # for which a loop over a run pays

# Particles of a run that are summed together; beyond its end what is found is not used.
_GROUP = 16


class PairArrays(NamedTuple):
    """What the sums of one load need."""

    reference: Array  # (n, d) X [m]
    rows: Rows  # with the values of pairs for weights
    shares: Indices  # (threads, 2) first block and end of each thread's blocks
    moving: Array  # (2 d, n + a group) positions [m], then velocities [m/s]


def pair_arrays(table: PairTable, reference: Array, threads: int) -> PairArrays:
    """The arrays of a load with these pairs between particles at `reference` (n, d) [m]."""
    # Rows are compared number by number: in units of the largest, as kinds of values differ.
    largest = np.abs(table.values).max(axis=0, initial=0.0)
    units = np.where(largest > 0.0, largest, 1.0)
    columns = table.columns.astype(np.intp)
    rows = rows_of(table.starts, columns, table.values / units, _SHORTEST_RUN)
    rows = rows._replace(
        stencil_weights=rows.stencil_weights * units, row_weights=rows.row_weights * units
    )
    done = np.concatenate([[0.0], np.cumsum(rows.costs())])
    edges = np.searchsorted(done, done[-1] * np.arange(threads + 1) / threads)
    edges[-1] = len(rows.blocks)
    n, d = reference.shape
    shares = np.stack([edges[:-1], edges[1:]], axis=1).astype(np.intp)
    return PairArrays(reference, rows, shares, np.zeros((2 * d, n + _GROUP)))


@cache
def pair_sweep(pull: Any, dimension: int, count: int, threaded: bool) -> Any:
    """Compiled (arrays, u (n, d), v (n, d), forces (n, d)), for a compiled formula `pull` of
    `count` values."""
    d, apart, add = dimension, _APART[dimension], _ADD[dimension]

    @njit(parallel=threaded)
    def place(threads, X, u, v, moving):
        n = len(X)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(d):
                    moving[i, p] = X[p, i] + u[p, i]
                    moving[d + i, p] = v[p, i]

    @njit(error_model="numpy")
    def run(first, number, offset, values, moving, sums):
        for k in range(number):
            # Unsigned: an index that might be negative, from the end, is not vectorised.
            slot, p, q = np.uintp(k), np.uintp(first + k), np.uintp(first + offset + k)
            way = apart(moving, np.uintp(0), p, q)
            pulled = pull(way, apart(moving, np.uintp(d), p, q), values)
            add(sums, slot, pulled, way)

    @njit
    def of_run(rows, first, number, stencil, moving, sums):
        whole = (number + _GROUP - 1) // _GROUP * _GROUP
        for m in range(rows.members[stencil], rows.members[stencil + 1]):
            values = to_fixed_tuple(rows.stencil_weights[m], count)
            run(first, whole, rows.offsets[m], values, moving, sums)

    @njit(error_model="numpy")
    def of_rows(rows, first, number, row, moving, sums):
        for k in range(number):
            slot, p = np.uintp(k), np.uintp(first + k)
            for m in range(rows.spans[row + k, 0], rows.spans[row + k, 1]):
                q = np.uintp(first + k + rows.row_offsets[m])
                way = apart(moving, np.uintp(0), p, q)
                values = to_fixed_tuple(rows.row_weights[m], count)
                add(sums, slot, pull(way, apart(moving, np.uintp(d), p, q), values), way)

    @njit(parallel=threaded)
    def sweep(rows, shares, moving, forces):
        for t in prange(len(shares)):
            sums = np.zeros(d * RUN)
            for block in range(shares[t, 0], shares[t, 1]):
                first, number, where = rows.blocks[block]
                sums[:] = 0.0
                if where >= 0:
                    of_run(rows, first, number, where, moving, sums)
                else:
                    of_rows(rows, first, number, -1 - where, moving, sums)
                for k in range(number):
                    for i in range(d):
                        forces[first + k, i] = sums[i * RUN + k]

    @njit
    def sums(arrays, u, v, forces):
        place(len(arrays.shares), arrays.reference, u, v, arrays.moving)
        sweep(arrays.rows, arrays.shares, arrays.moving, forces)

    return sums


# Vectors written out, by dimension: a loop over components would not be vectorised over particles.


@njit
def _apart_1(x, c, p, q):
    return (x[c, q] - x[c, p],)


@njit
def _apart_2(x, c, p, q):
    return x[c, q] - x[c, p], x[c + np.uintp(1), q] - x[c + np.uintp(1), p]


@njit
def _apart_3(x, c, p, q):
    second, third = c + np.uintp(1), c + np.uintp(2)
    return x[c, q] - x[c, p], x[second, q] - x[second, p], x[third, q] - x[third, p]


@njit
def _add_1(sums, slot, factor, a):
    sums[slot] += factor * a[0]


@njit
def _add_2(sums, slot, factor, a):
    sums[slot] += factor * a[0]
    sums[slot + np.uintp(RUN)] += factor * a[1]


@njit
def _add_3(sums, slot, factor, a):
    sums[slot] += factor * a[0]
    sums[slot + np.uintp(RUN)] += factor * a[1]
    sums[slot + np.uintp(2 * RUN)] += factor * a[2]


_APART = {1: _apart_1, 2: _apart_2, 3: _apart_3}
_ADD = {1: _add_1, 2: _add_2, 3: _add_3}
