"""A pass with a stress that depends on the rate beside that of the material, and its work."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.fixed.partition import buffered
from solidsph.engines.compiled.jit import njit


@cache
def rated_pass(dimension: int, dtype: str, stress_at: Any, rate_law: Any, threaded: bool) -> Any:
    """Compiled (table, rows, displacements, velocities, u, v, params, history, step, rate_params,
    stress (d, d, n), H (d, d, n), factors, buffers, forces, works): forces of both stresses.

    `stress_at` is one of `fixed/stress_at.py`, and `rate_law` compiled (H, dH/dt, params) -> T. The
    stress by the rate and H are kept. With those of the step before they give the work done by this
    stress, which is added to that of the thread: forces are the adjoint of H, so that work along a
    path is that of the stress along the change of H.
    """
    d = dimension
    place, cleared, total = buffered(d, dtype, threaded)
    gather, scatter, tensor, put, _, plane = block_loops(d, dtype)
    add = _ADD[d]

    @njit
    def sweep(
        rows, first, last, u, v, params, history, step, rate_params, stress, held, factors, f, shift
    ):
        scratch, rates = np.zeros(d * plane, u.dtype), np.zeros(d * plane, u.dtype)
        work = 0.0
        for block in range(first, last):
            gather(rows, block, u, scratch)
            gather(rows, block, v, rates)
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                p, H = start + slot, tensor(scratch, slot)
                T = rate_law(H, tensor(rates, slot), rate_params)
                power = 0.0
                for i in range(d):
                    for k in range(d):
                        power += (stress[i, k, p] + T[i][k]) * (H[i][k] - held[i, k, p])
                        stress[i, k, p], held[i, k, p] = T[i][k], H[i][k]
                work += 0.5 * factors[p] * power
                put(scratch, slot, add(stress_at(p, H, params, history, step), T), factors[p])
            scatter(rows, block, scratch, f, shift)
        return work

    @njit(parallel=threaded)
    def forces(
        table,
        rows,
        displacements,
        velocities,
        u,
        v,
        params,
        history,
        step,
        rate_params,
        stress,
        held,
        factors,
        buffers,
        out,
        works,
    ):
        place(len(table), displacements, u)
        place(len(table), velocities, v)
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            works[t] += sweep(
                rows,
                first,
                last,
                u,
                v,
                params,
                history,
                step,
                rate_params,
                stress,
                held,
                factors,
                buffers,
                shift,
            )
        total(table, buffers, out)

    return forces


@njit
def _add_1(A, B):
    return ((A[0][0] + B[0][0],),)


@njit
def _add_2(A, B):
    return (A[0][0] + B[0][0], A[0][1] + B[0][1]), (A[1][0] + B[1][0], A[1][1] + B[1][1])


@njit
def _add_3(A, B):
    return (
        (A[0][0] + B[0][0], A[0][1] + B[0][1], A[0][2] + B[0][2]),
        (A[1][0] + B[1][0], A[1][1] + B[1][1], A[1][2] + B[1][2]),
        (A[2][0] + B[2][0], A[2][1] + B[2][1], A[2][2] + B[2][2]),
    )


_ADD = {1: _add_1, 2: _add_2, 3: _add_3}
