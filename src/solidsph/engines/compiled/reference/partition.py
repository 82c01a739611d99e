"""Partition: which blocks each thread sweeps, and where it adds up its forces.

A thread scatters into a buffer of its own, over its particles and those within reach. Buffers are
summed in order, so the same number of threads gives the same bits.
"""

from __future__ import annotations

import os
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import attrs
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from solidsph.engines.compiled.reference.block_sweeps import block_sweeps, spread_sweep
from solidsph.engines.compiled.reference.blocks import STRIDE, group
from solidsph.engines.compiled.reference.rows import Rows
from solidsph.engines.compiled.threads import check_alive, started
from solidsph.maths.arrays import Indices

# A second thread must be woken for every pass, which takes some tens of microseconds: as long as
# one thread takes for so many operations of a nanosecond.
WORTH_A_THREAD = 200_000

_ALIGNMENT = 64  # bytes of a cache line

# OpenMP threads that have done their share spin until the others have too: where a core is busy
# with something else, that costs time slices. Read when the first parallel loop starts.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")


def thread_count(operations: int) -> int:
    """How many threads share so many operations of about a nanosecond in several passes."""
    return 1 if operations < WORTH_A_THREAD else started()


@attrs.frozen(eq=False)
class Partition:
    """The division of rows among threads."""

    # (t, 5) for each thread: its first block, the one after its last, the first particle that it
    # reaches, the one after the last, and where particle 0 would stand in the common array
    table: Indices
    buffers: NDArray[Any]  # all buffers, flat

    @property
    def threaded(self) -> bool:
        """Whether there is more than one."""
        return len(self.table) > 1

    def check(self) -> None:
        """That there are the threads that share.

        Raises:
            ForkError: in a fork of the process that had started them there are none.
        """
        if self.threaded:
            check_alive()


def partitioned(rows: Rows, dimension: int, dtype: str, threads: int) -> Partition:
    """Blocks divided among `threads` by the work that they are."""
    done = np.concatenate([[0.0], np.cumsum(rows.costs())])
    edges = np.searchsorted(done, done[-1] * np.arange(threads + 1) / threads)
    low, high = _reach(rows)
    table = np.zeros((threads, 5), dtype=np.intp)
    stride, margin = STRIDE[dimension], group(dimension, dtype)
    line = _ALIGNMENT // np.dtype(dtype).itemsize
    end = 0
    for share, (first, last) in enumerate(pairwise(edges.tolist())):
        if first == last:
            continue
        a, b = int(low[first:last].min()), int(high[first:last].max())
        table[share] = first, last, a, b, end - a * stride
        # Loops over runs go beyond the last particle by up to a group.
        end += -(-(b - a + margin) * stride // line) * line
    return Partition(table, aligned(end, dtype))


def aligned(count: int, dtype: str) -> NDArray[Any]:
    """Zeros (count,) that begin on a cache line."""
    extra = _ALIGNMENT // np.dtype(dtype).itemsize
    array = np.zeros(count + extra, dtype=dtype)
    skipped = -array.ctypes.data % _ALIGNMENT // array.itemsize
    return array[skipped : skipped + count]


def _reach(rows: Rows) -> tuple[Indices, Indices]:
    """First particle that each block scatters to, and the one after the last, (b,) each."""
    first, count, where = rows.blocks.T
    low, high = first.copy(), first + count
    run = where >= 0
    stencil = where[run]
    low[run] += rows.offsets[rows.members[stencil]]
    high[run] += rows.offsets[rows.members[stencil + 1] - 1]
    if not run.all():
        begins = -1 - where[~run]  # blocks of rows stand in their order
        own = np.repeat(first[~run], count[~run]) + _place_in(count[~run])
        low[~run] = np.minimum.reduceat(own + rows.row_offsets[rows.spans[:, 0]], begins)
        high[~run] = np.maximum.reduceat(own + rows.row_offsets[rows.spans[:, 1] - 1], begins) + 1
    return low, high


def _place_in(counts: Indices) -> Indices:
    """0, 1, ... within each of several groups of so many, one behind the other."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)


class Passes(NamedTuple):
    """Compiled passes over all particles of a body, by one thread or several."""

    # (table, rows, displacements (n, d), u, params, factors, buffers, forces (n, d))
    forces: Any
    # (table, rows, displacements (n, d), u, params, stress (d, d, n))
    stress: Any


@cache
def passes(dimension: int, dtype: str, law: Any, threaded: bool) -> Passes:
    """Passes for one dimension, number type and compiled law (H, params) -> T."""
    place, cleared, total = _fields(dimension, dtype, threaded)
    sweep_forces, sweep_stress = block_sweeps(dimension, dtype, law)

    @njit(parallel=threaded)
    def forces(table, rows, displacements, u, params, factors, buffers, out):
        place(len(table), displacements, u)
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            sweep_forces(rows, first, last, u, params, factors, buffers, shift)
        total(table, buffers, out)

    @njit(parallel=threaded)
    def stress(table, rows, displacements, u, params, out):
        place(len(table), displacements, u)
        for t in prange(len(table)):
            sweep_stress(rows, table[t, 0], table[t, 1], u, params, out)

    return Passes(forces, stress)


@cache
def spread_pass(dimension: int, dtype: str, threaded: bool) -> Any:
    """LoadKind (table, rows, stress (d, d, n), factors, buffers, forces (n, d)) for any law."""
    _, cleared, total = _fields(dimension, dtype, threaded)
    sweep = spread_sweep(dimension, dtype)

    @njit(parallel=threaded)
    def spread(table, rows, stress, factors, buffers, out):
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            sweep(rows, first, last, stress, factors, buffers, shift)
        total(table, buffers, out)

    return spread


@cache
def _fields(dimension: int, dtype: str, threaded: bool) -> tuple[Any, Any, Any]:
    """Compiled: displacements made flat, a share's buffer cleared, the sum of all buffers."""
    d, D = dimension, STRIDE[dimension]
    margin = group(dimension, dtype)

    @njit(parallel=threaded)
    def place(threads, displacements, u):
        n = len(displacements)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(d):
                    u[p * D + i] = displacements[p, i]

    @njit
    def cleared(share, buffers):
        low, high, shift = share[2], share[3], share[4]
        buffers[low * D + shift : (high + margin) * D + shift] = 0.0

    @njit(parallel=threaded)
    def total(table, buffers, forces):
        n, threads = len(forces), len(table)
        for t in prange(threads):
            start, stop = t * n // threads, (t + 1) * n // threads
            forces[start:stop] = 0.0
            for share in range(threads):
                shift = table[share, 4]
                for p in range(max(start, table[share, 2]), min(stop, table[share, 3])):
                    for i in range(d):
                        forces[p, i] += buffers[p * D + shift + i]

    return place, cleared, total
