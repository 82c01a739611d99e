"""Hourglass forces as compiled sweeps over pairs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple, final

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.engines.compiled.fixed.blocks import group
from solidsph.engines.compiled.fixed.chunks import weighted_chunks
from solidsph.engines.compiled.fixed.partition import (
    flat_field,
    partitioned,
    passes,
    spread_pass,
    thread_count,
)
from solidsph.engines.compiled.fixed.rows import Rows, compressed
from solidsph.engines.compiled.fixed.subset_rows import part_of_rows
from solidsph.engines.compiled.hourglass_pairs import NearPairs, near_pass
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.planes import adding, filling
from solidsph.engines.compiled.pointwise import no_law
from solidsph.engines.compiled.threads import check_alive
from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassPairs
from solidsph.interfaces.plan import Operations, SumMethod, array_bytes, vectors
from solidsph.maths.arrays import Array, Indices

_DTYPE = "float64"


class HourglassArrays(NamedTuple):
    """Arrays of the sweeps of one body."""

    extent: tuple[int, int]  # its first particle among all and the end of its particles
    table: Indices  # partition among threads
    rows: Rows  # of the gradient
    flat: NDArray[Any]  # displacements for loops over rows
    factors: Array  # (n,) -1: the stress is times the volume already
    buffers: NDArray[Any]
    near: NearPairs
    gradients: Array  # H among the jets of near pairs, (d, d, n and more)
    stresses: Array  # S among their pulls, (d, d, n and more)


@final
@attrs.frozen(eq=False)
class HourglassSweeps(HourglassOperator):
    """Hourglass forces in three sweeps: gather H, sum over near pairs, scatter the stress.

    The first and the last are loops over rows, which particles on a lattice share.
    """

    pairs: HourglassPairs
    arrays: HourglassArrays
    sweep: Any  # compiled (arrays, displacements (n, d), forces (n, d))

    @classmethod
    def of(cls, pairs: HourglassPairs) -> HourglassSweeps:
        """The operator of these pairs."""
        n, d = pairs.body.particles.positions.shape
        shortest_run = max(2, group(d, _DTYPE) // 2)
        chunks = weighted_chunks(pairs.body, np.ones(n, dtype=np.bool_))
        return cls._by_rows(pairs, compressed(chunks, d, _DTYPE, shortest_run))

    def part(self, chosen: Indices) -> HourglassSweeps:
        count = self.pairs.body.particles.count
        return self._by_rows(self.pairs.part(chosen), part_of_rows(self.arrays.rows, chosen, count))

    @classmethod
    def _by_rows(cls, pairs: HourglassPairs, rows: Rows) -> HourglassSweeps:
        """The operator with these rows of the gradient's weights."""
        body = pairs.body
        n, d = body.particles.positions.shape
        # Besides the near pairs there are those of the gradient, twice.
        threads = thread_count(3 * len(pairs.table.columns))
        partition = partitioned(rows, d, _DTYPE, threads)
        near = NearPairs.of(pairs, threads)
        arrays = HourglassArrays(
            extent=(body.extent.start, body.extent.stop),
            table=partition.table,
            rows=rows,
            flat=flat_field(n, d, _DTYPE),
            factors=np.full(n, -1.0),
            buffers=partition.buffers,
            near=near,
            gradients=near.tensors(near.jets),
            stresses=near.tensors(near.pulls),
        )
        return cls(pairs, arrays, hourglass_sweep(d, threads > 1))

    @property
    def bytes(self) -> int:
        parts = (self.arrays, self.arrays.near, self.arrays.near.pairs)
        arrays = (a for part in parts for a in part if isinstance(a, np.ndarray) and a.base is None)
        return array_bytes(arrays) + self.arrays.rows.bytes

    def operations(self, *, compiled: bool) -> Operations:
        n, d = self.pairs.body.particles.positions.shape
        rows = self.arrays.rows
        # Once to gather H, once to scatter the stress, and the near pairs in between.
        pairs = 2 * (rows.run_pairs + rows.row_pairs) + len(self.pairs.table.columns)
        threaded = len(self.arrays.table) > 1
        touched = self.bytes + vectors(n, d)
        return Operations(
            SumMethod.HOURGLASS_SWEEPS, pairs, n, touched, self.bytes, threaded=threaded
        )

    def forces(self, displacements: Array) -> Array:
        if len(self.arrays.table) > 1:
            check_alive()
        forces = np.empty_like(displacements)
        self.sweep(self.arrays, np.ascontiguousarray(displacements), forces)
        return forces


def compiled_sweeps(operators: Sequence[HourglassOperator]) -> Sequence[HourglassSweeps]:
    """The operators as compiled sweeps."""
    return [
        operator if isinstance(operator, HourglassSweeps) else HourglassSweeps.of(operator.pairs)
        for operator in operators
    ]


@cache
def hourglass_sweep(dimension: int, threaded: bool) -> Any:
    """Compiled (arrays, displacements (n, d), forces (n, d)): the forces of one body."""
    d = dimension
    gather = passes(d, _DTYPE, no_law, threaded).stress
    scatter = spread_pass(d, _DTYPE, threaded)
    pull = near_pass(d, threaded)

    fill, add = filling(d, threaded), adding(d, threaded)

    @njit
    def sweep(arrays, displacements, forces):
        near, table = arrays.near, arrays.table
        threads, stride = len(table), arrays.gradients.shape[2]
        gather(table, arrays.rows, displacements, arrays.flat, (0.0,), arrays.gradients)
        fill(threads, displacements, near.jets, stride)
        pull(near.shares, near.pairs, near.jets, near.sums, near.pulls)
        scatter(table, arrays.rows, arrays.stresses, arrays.factors, arrays.buffers, forces)
        add(threads, near.pulls, stride, forces)

    return sweep


@cache
def body_sweep(sweep: Any) -> Any:
    """Compiled (arrays, u (n, d), v (n, d), forces (n, d)): `sweep` of one body among all
    particles, which velocities v do not change."""

    @njit
    def own(arrays, u, v, forces):
        some = slice(arrays.extent[0], arrays.extent[1])
        sweep(arrays, u[some], forces[some])

    return own
