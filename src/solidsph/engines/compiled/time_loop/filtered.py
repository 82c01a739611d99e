"""Internal forces of a body that filters its dilatation, in the compiled loop."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import prange
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solidsph.engines.compiled.fixed.rows import Rows, compressed_matrix
from solidsph.engines.compiled.history_law import history_count, stepping_law
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import numbers, registered
from solidsph.engines.compiled.vectors import IDENTITY
from solidsph.maths.arrays import Array, Indices
from solidsph.maths.dilatation import Dilatation
from solidsph.maths.tensors import add, scale
from solidsph.model.smooth_part import SmoothPart

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody

# Smallest number of particles for which a stencil pays: the numbers of a register.
_SHORTEST_RUN = 4


class FilteredBody(NamedTuple):
    """The arrays of one body."""

    extent: tuple[int, int]  # its first particle and the end of its particles
    table: Indices  # partition among threads
    rows: Rows
    u: NDArray[Any]  # flat
    params: tuple[float, ...]
    factors: NDArray[Any]
    buffers: NDArray[Any]
    history: Array  # (n, k) internal variables; k is 0 for a material without
    step: float  # by which they advance [s]
    rough: Rows  # R
    back: Rows  # -R*
    modulus: float  # kappa [Pa]
    gradients: Array  # H (d, d, n)
    stress: Array  # (d, d, n)
    dilatation: Array  # (n,)
    left: Array  # (n,) R of it
    once: Array  # (n,) S theta - theta
    twice: Array  # (n,) the same of that


def filtered_data(part: ReferenceBody, step: float) -> FilteredBody:
    """The arrays of a body, in steps of `step` [s]."""
    own, body = part.gradient_partition, part.body
    n, d = body.particles.positions.shape
    assert body.dilatation_filter is not None
    rough, back = _both(body.dilatation_filter.smooth_part)
    return FilteredBody(
        extent=(body.extent.start, body.extent.stop),
        table=own.table,
        rows=part.gradient,
        u=part.u,
        params=body.material.params,
        factors=part.factors,
        buffers=own.buffers,
        history=part.history(),
        step=step,
        rough=rough,
        back=back,
        modulus=body.dilatation_filter.modulus,
        gradients=np.zeros((d, d, n)),
        stress=np.zeros((d, d, n)),
        dilatation=np.zeros(n),
        left=np.zeros(n),
        once=np.zeros(n),
        twice=np.zeros(n),
    )


def _both(smooth_part: SmoothPart) -> tuple[Rows, Rows]:
    back = csr_array(-smooth_part.adjoint)
    return compressed_matrix(smooth_part.rows, _SHORTEST_RUN), compressed_matrix(
        back, _SHORTEST_RUN
    )


def filtered_forces(part: ReferenceBody) -> Any:
    """Compiled (data, u (n, d), v (n, d), total (n, d)) that sets the forces of one body.

    Raises:
        NotCompilableError: the law does not compile.
    """
    body = part.body
    assert body.dilatation_filter is not None
    law = _law(
        body.smoothing.dimension,
        history_count(body),
        stepping_law(body, part.law),
        body.dilatation_filter.dilatation,
        part.gradient_partition.threaded,
    )
    return _forces(part.gradient_pass, law, part.spread_pass)


@cache
def _law(dimension: int, count: int, law: Any, measure: Dilatation, threaded: bool) -> Any:
    """Compiled (body): its stress from its gradients."""
    theta_of, slope_of = registered(measure.of), registered(measure.slope)
    d, identity = dimension, IDENTITY[dimension]
    plus, times_number = registered(add), registered(scale)

    @njit
    def at(field, p):
        if d == 2:
            return ((field[0, 0, p], field[0, 1, p]), (field[1, 0, p], field[1, 1, p]))
        return (
            (field[0, 0, p], field[0, 1, p], field[0, 2, p]),
            (field[1, 0, p], field[1, 1, p], field[1, 2, p]),
            (field[2, 0, p], field[2, 1, p], field[2, 2, p]),
        )

    @njit
    def put(field, p, T):
        for i in range(d):
            for k in range(d):
                field[i, k, p] = T[i][k]

    @njit(parallel=threaded)
    def times(threads, rows, field, out):
        n = len(rows.blocks)
        for t in prange(threads):
            for block in range(t * n // threads, (t + 1) * n // threads):
                start, count, where = rows.blocks[block]
                if where >= 0:
                    by_stencil(rows, where, field, start, out[start : start + count])
                else:
                    by_rows(rows, -1 - where, field, start, out[start : start + count])

    @njit(parallel=threaded, error_model="numpy")
    def dilatation(threads, gradients, out):
        n = len(out)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                out[p] = theta_of(plus(at(gradients, p), identity))

    @njit(parallel=threaded, error_model="numpy")
    def whole(threads, gradients, once, twice, modulus, history, step, params, stress):
        n = len(once)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                H = at(gradients, p)
                T, h = law(numbers(H), to_fixed_tuple(history[p], count), step, params)
                for k in range(count):
                    history[p, k] = h[k]
                q = modulus * (once[p] + once[p] + twice[p])
                put(stress, p, plus(T, times_number(q, slope_of(plus(H, identity)))))

    @njit
    def filtered(body):
        threads, H, once, twice = len(body.table), body.gradients, body.once, body.twice
        dilatation(threads, H, body.dilatation)
        for field, change in ((body.dilatation, once), (once, twice)):
            times(threads, body.rough, field, body.left)
            times(threads, body.back, body.left, change)
        whole(
            threads,
            H,
            once,
            twice,
            body.modulus,
            body.history,
            body.step,
            body.params,
            body.stress,
        )

    return filtered


@njit
def by_stencil(rows, stencil, field, start, out):
    """Products with the rows of particles from `start` on that share a stencil, (k,)."""
    out[:] = 0.0
    for m in range(rows.members[stencil], rows.members[stencil + 1]):
        weight, first = rows.stencil_weights[m, 0], start + rows.offsets[m]
        values = field[first : first + len(out)]
        for slot in range(len(out)):
            out[slot] += weight * values[slot]


@njit
def by_rows(rows, row, field, start, out):
    """Products with rows of their own, from `row` on, of particles from `start` on, (k,)."""
    for slot in range(len(out)):
        total = 0.0
        for m in range(rows.spans[row + slot, 0], rows.spans[row + slot, 1]):
            total += rows.row_weights[m, 0] * field[start + slot + rows.row_offsets[m]]
        out[slot] = total


@cache
def _forces(gradient_pass: Any, law: Any, spread: Any) -> Any:
    @njit
    def forces(body, u, v, total):
        a, b = body.extent
        gradient_pass(body.table, body.rows, u[a:b], body.u, body.params, body.gradients)
        law(body)
        spread(body.table, body.rows, body.stress, body.factors, body.buffers, total[a:b])

    return forces
