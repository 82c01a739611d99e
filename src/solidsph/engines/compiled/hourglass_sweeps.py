"""Hourglass forces as compiled sweeps over pairs."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple, final

import attrs
import numpy as np
from numba import prange
from numba.np.unsafe.ndarray import to_fixed_tuple
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
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import no_law
from solidsph.engines.compiled.threads import check_alive
from solidsph.engines.compiled.vectors import ROW, moved
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
    factors: Array  # (n,) minus the volumes
    buffers: NDArray[Any]
    starts: Indices  # of the near pairs of each particle
    columns: NDArray[np.int32]
    weights: Array  # (k,)
    positions: Array  # (n, d) X
    jets: Array  # (n, d, 1 + d) displacement and half of its gradient
    tensors: Array  # (d, d, n) H, then S
    pulls: Array  # (n, d) sums of pair forces


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
        arrays = HourglassArrays(
            extent=(body.extent.start, body.extent.stop),
            table=partition.table,
            rows=rows,
            flat=flat_field(n, d, _DTYPE),
            factors=-body.particles.volumes,
            buffers=partition.buffers,
            starts=pairs.table.starts,
            columns=pairs.table.columns,
            weights=pairs.weights,
            positions=body.particles.positions,
            jets=np.empty((n, d, 1 + d)),
            tensors=np.zeros((d, d, n)),
            pulls=np.zeros((n, d)),
        )
        return cls(pairs, arrays, hourglass_sweep(d, threads > 1))

    @property
    def bytes(self) -> int:
        arrays = (a for a in self.arrays if isinstance(a, np.ndarray))
        return array_bytes(arrays) + self.arrays.rows.bytes

    def operations(self, *, compiled: bool) -> Operations:
        n, d = self.arrays.positions.shape
        rows = self.arrays.rows
        # Once to gather H, once to scatter the stress, and the near pairs in between.
        pairs = 2 * (rows.run_pairs + rows.row_pairs) + len(self.arrays.columns)
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


@cache
def hourglass_sweep(dimension: int, threaded: bool) -> Any:
    """Compiled (arrays, displacements (n, d), forces (n, d)): the forces of one body."""
    d = dimension
    gather = passes(d, _DTYPE, no_law, threaded).stress
    scatter = spread_pass(d, _DTYPE, threaded)
    row, nothing, size = ROW[d], (0.0,) * (1 + d), 1 + d

    @njit(parallel=threaded)
    def place(displacements, tensors, jets):
        for a in prange(len(jets)):
            for i in range(d):
                jets[a, i, 0] = displacements[a, i]
                for k in range(d):
                    jets[a, i, 1 + k] = 0.5 * tensors[i, k, a]

    # A particle without volume gives undefined values, and no error.
    @njit(parallel=threaded, error_model="numpy")
    def pull(starts, columns, weights, X, factors, jets, pulls, tensors):
        for a in prange(len(pulls)):
            # Force and products of each component; those of missing dimensions are not used.
            sums_x, sums_y, sums_z = nothing, nothing, nothing
            X_a, own_x = row(X, a), to_fixed_tuple(jets[a, 0], size)
            if d > 1:
                own_y = to_fixed_tuple(jets[a, 1], size)
            if d > 2:
                own_z = to_fixed_tuple(jets[a, 2], size)
            for k in range(starts[a], starts[a + 1]):
                b, c = columns[k], weights[k]
                X_ab = moved(row(X, b), -1.0, X_a)
                sums_x = _with(sums_x, c * _error(own_x, jets, b, 0, X_ab), X_ab)
                if d > 1:
                    sums_y = _with(sums_y, c * _error(own_y, jets, b, 1, X_ab), X_ab)
                if d > 2:
                    sums_z = _with(sums_z, c * _error(own_z, jets, b, 2, X_ab), X_ab)
            sums = (sums_x, sums_y, sums_z)
            for i in range(d):
                pulls[a, i] = -sums[i][0]
                for k in range(d):
                    # Divided by the volume, which the scatter multiplies by.
                    tensors[i, k, a] = -0.5 * sums[i][1 + k] / factors[a]

    @njit
    def sweep(arrays, displacements, forces):
        gather(arrays.table, arrays.rows, displacements, arrays.flat, (0.0,), arrays.tensors)
        place(displacements, arrays.tensors, arrays.jets)
        pull(
            arrays.starts,
            arrays.columns,
            arrays.weights,
            arrays.positions,
            arrays.factors,
            arrays.jets,
            arrays.pulls,
            arrays.tensors,
        )
        scatter(arrays.table, arrays.rows, arrays.tensors, arrays.factors, arrays.buffers, forces)
        forces += arrays.pulls

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


@njit
def _error(own, jets, b, i, X_ab):
    """Component i of e_ab, from its row `own` of the jet of a; exactly minus that of e_ba."""
    along = (own[1] + jets[b, i, 1]) * X_ab[0]
    if len(X_ab) > 1:
        along += (own[2] + jets[b, i, 2]) * X_ab[1]
    error = own[0] - jets[b, i, 0] + along
    if len(X_ab) > 2:
        error += (own[3] + jets[b, i, 3]) * X_ab[2]
    return error


@njit
def _with(sums, e, X_ab):
    """Sums of e and of e X_ab, with one pair more."""
    if len(X_ab) == 1:
        return sums[0] + e, sums[1] + e * X_ab[0]
    if len(X_ab) == 2:
        return sums[0] + e, sums[1] + e * X_ab[0], sums[2] + e * X_ab[1]
    return sums[0] + e, sums[1] + e * X_ab[0], sums[2] + e * X_ab[1], sums[3] + e * X_ab[2]
