"""Partition of rows among threads, and the passes over all particles of a body.

Each thread scatters into a buffer of its own, over its particles and those within reach. Buffers
are summed in order, so that the same number of threads gives the same bits.
"""

from __future__ import annotations

import os
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import attrs
import numpy as np
from numba import prange
from numpy.typing import NDArray

from solidsph.engines.compiled.constants import STRIDE, WORTH_A_THREAD
from solidsph.engines.compiled.fixed.block_sweeps import (
    block_sweeps,
    history_sweep,
    rate_sweep,
    spread_sweep,
)
from solidsph.engines.compiled.fixed.blocks import group
from solidsph.engines.compiled.fixed.rows import Rows
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.threads import check_alive, started
from solidsph.maths.arrays import Indices
from solidsph.model.neighbours import ranges

_ALIGNMENT = 64  # bytes of a cache line

# OpenMP threads that are done would spin until the others are too, which costs time slices where a
# core is busy with something else. Read when the first parallel loop starts.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")


def thread_count(operations: int) -> int:
    """Number of threads for so many operations of about a nanosecond in several passes."""
    return 1 if operations < WORTH_A_THREAD else started()


@attrs.frozen(eq=False)
class Partition:
    """The division of rows among threads."""

    # (t, 5) per thread: first block and end of its blocks, first particle and end of those that it
    # reaches, and the offset of particle 0 in the common array
    table: Indices
    buffers: NDArray[Any]  # all buffers, flat

    @property
    def threaded(self) -> bool:
        """True if there is more than one thread."""
        return len(self.table) > 1

    def check(self) -> None:
        """Check that the threads exist.

        Raises:
            ForkError: this process is a fork of the one that started them.
        """
        if self.threaded:
            check_alive()


def partitioned(rows: Rows, dimension: int, dtype: str, threads: int) -> Partition:
    """Blocks divided among `threads` by their work."""
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
    return Partition(table, _aligned(end, dtype))


def flat_field(particles: int, dimension: int, dtype: str) -> NDArray[Any]:
    """A flat field of vectors for loops over runs, which read up to a group beyond the last."""
    return _aligned((particles + group(dimension, dtype)) * STRIDE[dimension], dtype)


def _aligned(count: int, dtype: str) -> NDArray[Any]:
    """Zeros (count,) that begin on a cache line."""
    extra = _ALIGNMENT // np.dtype(dtype).itemsize
    array = np.zeros(count + extra, dtype=dtype)
    skipped = -array.ctypes.data % _ALIGNMENT // array.itemsize
    return array[skipped : skipped + count]


def _reach(rows: Rows) -> tuple[Indices, Indices]:
    """First particle that each block scatters to and the end of these, (b,) each."""
    first, count, where = rows.blocks.T
    low, high = first.copy(), first + count
    run = where >= 0
    stencil = where[run]
    low[run] += rows.offsets[rows.members[stencil]]
    high[run] += rows.offsets[rows.members[stencil + 1] - 1]
    if not run.all():
        begins = -1 - where[~run]  # blocks of rows are in order
        own = ranges(first[~run], count[~run])
        low[~run] = np.minimum.reduceat(own + rows.row_offsets[rows.spans[:, 0]], begins)
        high[~run] = np.maximum.reduceat(own + rows.row_offsets[rows.spans[:, 1] - 1], begins) + 1
    return low, high


class Passes(NamedTuple):
    """Compiled passes over all particles of a body, by one thread or several."""

    # (table, rows, displacements (n, d), u, params, factors, buffers, forces (n, d))
    forces: Any
    # (table, rows, displacements (n, d), u, params, stress (d, d, n))
    stress: Any


@cache
def passes(dimension: int, dtype: str, law: Any, threaded: bool) -> Passes:
    """The passes for one dimension, number type and compiled law (H, params) -> T."""
    place, cleared, total = buffered(dimension, dtype, threaded)
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
def history_pass(dimension: int, dtype: str, law: Any, count: int, threaded: bool) -> Any:
    """Compiled pass (table, rows, displacements, u, params, factors, buffers, forces, history
    (n, `count`), step) for a compiled law (H, h, step, params) -> (T, h)."""
    place, cleared, total = buffered(dimension, dtype, threaded)
    sweep = history_sweep(dimension, dtype, law, count)

    @njit(parallel=threaded)
    def forces(table, rows, displacements, u, params, factors, buffers, out, history, step):
        place(len(table), displacements, u)
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            sweep(rows, first, last, u, params, factors, buffers, shift, history, step)
        total(table, buffers, out)

    return forces


@cache
def rate_pass(dimension: int, dtype: str, law: Any, threaded: bool) -> Any:
    """Compiled pass (table, rows, displacements, velocities, u, v, params, factors, buffers,
    forces) for a compiled law (H, dH/dt, params) -> T."""
    place, cleared, total = buffered(dimension, dtype, threaded)
    sweep = rate_sweep(dimension, dtype, law)

    @njit(parallel=threaded)
    def forces(table, rows, displacements, velocities, u, v, params, factors, buffers, out):
        place(len(table), displacements, u)
        place(len(table), velocities, v)
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            sweep(rows, first, last, u, v, params, factors, buffers, shift)
        total(table, buffers, out)

    return forces


@cache
def spread_pass(dimension: int, dtype: str, threaded: bool) -> Any:
    """Compiled pass (table, rows, stress (d, d, n), factors, buffers, forces (n, d))."""
    _, cleared, total = buffered(dimension, dtype, threaded)
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
def buffered(dimension: int, dtype: str, threaded: bool) -> tuple[Any, Any, Any]:
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
        if high > low:  # a thread without work has no buffer, and must not touch another's
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
