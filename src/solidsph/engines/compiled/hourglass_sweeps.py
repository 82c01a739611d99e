"""Hourglass forces as compiled sweeps over pairs, and within the compiled loop."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple, final

import attrs
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from solidsph.engines.compiled.pointwise import no_law
from solidsph.engines.compiled.reference.blocks import STRIDE, group
from solidsph.engines.compiled.reference.chunks import weighted_chunks
from solidsph.engines.compiled.reference.partition import (
    aligned,
    partitioned,
    passes,
    spread_pass,
    thread_count,
)
from solidsph.engines.compiled.reference.rows import Rows, compressed
from solidsph.engines.compiled.reference.subset_rows import part_of_rows
from solidsph.engines.compiled.threads import check_alive
from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassPairs
from solidsph.interfaces.plan import Operations, SumMethod, vectors
from solidsph.maths.arrays import Array, Indices

_DTYPE = "float64"


class HourglassArrays(NamedTuple):
    """Arrays of the sweeps of one body."""

    extent: tuple[int, int]  # its first particle among all, and the one after the last
    table: Indices  # of the threads
    rows: Rows  # the gradient's
    flat: NDArray[Any]  # displacements for the loops over rows
    factors: Array  # (n,) minus the volumes
    buffers: NDArray[Any]
    starts: Indices  # near pairs
    columns: NDArray[np.int32]
    weights: Array
    positions: Array  # (n, d) X
    jets: Array  # (n, d, 1 + d) displacement and half its gradient
    tensors: Array  # (d, d, n) H, then S
    pulls: Array  # (n, d) sums of pair forces


@final
@attrs.frozen(eq=False)
class HourglassSweeps(HourglassOperator):
    """Three sweeps: gather H, pull the near pairs together, scatter the stress that they make.

    The first and the last are loops over rows that a lattice shares between particles.
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
        """By rows of the gradient's weights."""
        body = pairs.body
        n, d = body.particles.positions.shape
        # Beside the near pairs there are those of the gradient, twice.
        threads = thread_count(3 * len(pairs.table.columns))
        shares = partitioned(rows, d, _DTYPE, threads)
        arrays = HourglassArrays(
            extent=(body.extent.start, body.extent.stop),
            table=shares.table,
            rows=rows,
            flat=aligned((n + group(d, _DTYPE)) * STRIDE[d], _DTYPE),
            factors=-body.particles.volumes,
            buffers=shares.buffers,
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
        own = [a.nbytes for a in self.arrays if isinstance(a, np.ndarray)]
        return sum(own) + self.arrays.rows.bytes

    def operations(self, *, compiled: bool) -> Operations:
        n, d = self.arrays.positions.shape
        rows = self.arrays.rows
        # Once to gather H, once to scatter the stress, and the near pairs between.
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
    zeros, offset, row, error, more = _words(d)

    @njit(parallel=threaded)
    def place(displacements, tensors, jets):
        for a in prange(len(jets)):
            for i in range(d):
                jets[a, i, 0] = displacements[a, i]
                for k in range(d):
                    jets[a, i, 1 + k] = 0.5 * tensors[i, k, a]

    # A particle without volume makes what is undefined show as such, and no error.
    @njit(parallel=threaded, error_model="numpy")
    def pull(starts, columns, weights, X, factors, jets, pulls, tensors):
        for a in prange(len(pulls)):
            # Force and products of each component; those of missing dimensions are not used.
            nothing = zeros()
            sums_x, sums_y, sums_z = nothing, nothing, nothing
            own_x = row(jets, a, 0)
            if d > 1:
                own_y = row(jets, a, 1)
            if d > 2:
                own_z = row(jets, a, 2)
            for k in range(starts[a], starts[a + 1]):
                b, c = columns[k], weights[k]
                o = offset(X, a, b)
                sums_x = more(sums_x, c * error(own_x, jets, b, 0, o), o)
                if d > 1:
                    sums_y = more(sums_y, c * error(own_y, jets, b, 1, o), o)
                if d > 2:
                    sums_z = more(sums_z, c * error(own_z, jets, b, 2, o), o)
            sums = (sums_x, sums_y, sums_z)
            for i in range(d):
                pulls[a, i] = -sums[i][0]
                for k in range(d):
                    # Over the volume, which the scatter multiplies by.
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
    """Compiled (arrays, u (n, d), forces (n, d)) as `sweep`, of one body among all particles."""

    @njit
    def own(arrays, u, forces):
        some = slice(arrays.extent[0], arrays.extent[1])
        sweep(arrays, u[some], forces[some])

    return own


def _words(dimension: int) -> tuple[Any, Any, Any, Any, Any]:
    """Compiled: empty sums, offset of b from a, a row of a jet, its e_ab, and sums with one more.

    e_ba is minus e_ab to the last bit, so that the forces on the two cancel.
    """
    if dimension == 1:

        @njit
        def zeros():
            return 0.0, 0.0

        @njit
        def offset(X, a, b):
            return (X[b, 0] - X[a, 0],)

        @njit
        def row(jets, a, i):
            return jets[a, i, 0], jets[a, i, 1]

        @njit
        def error(own, jets, b, i, o):
            return own[0] - jets[b, i, 0] + (own[1] + jets[b, i, 1]) * o[0]

        @njit
        def more(sums, e, o):
            return sums[0] + e, sums[1] + e * o[0]

    elif dimension == 2:

        @njit
        def zeros():
            return 0.0, 0.0, 0.0

        @njit
        def offset(X, a, b):
            return X[b, 0] - X[a, 0], X[b, 1] - X[a, 1]

        @njit
        def row(jets, a, i):
            return jets[a, i, 0], jets[a, i, 1], jets[a, i, 2]

        @njit
        def error(own, jets, b, i, o):
            along = (own[1] + jets[b, i, 1]) * o[0] + (own[2] + jets[b, i, 2]) * o[1]
            return own[0] - jets[b, i, 0] + along

        @njit
        def more(sums, e, o):
            return sums[0] + e, sums[1] + e * o[0], sums[2] + e * o[1]

    else:

        @njit
        def zeros():
            return 0.0, 0.0, 0.0, 0.0

        @njit
        def offset(X, a, b):
            return X[b, 0] - X[a, 0], X[b, 1] - X[a, 1], X[b, 2] - X[a, 2]

        @njit
        def row(jets, a, i):
            return (
                jets[a, i, 0],
                jets[a, i, 1],
                jets[a, i, 2],
                jets[a, i, 3],
            )

        @njit
        def error(own, jets, b, i, o):
            along = (own[1] + jets[b, i, 1]) * o[0] + (own[2] + jets[b, i, 2]) * o[1]
            return own[0] - jets[b, i, 0] + along + (own[3] + jets[b, i, 3]) * o[2]

        @njit
        def more(sums, e, o):
            return sums[0] + e, sums[1] + e * o[0], sums[2] + e * o[1], sums[3] + e * o[2]

    return zeros, offset, row, error, more
