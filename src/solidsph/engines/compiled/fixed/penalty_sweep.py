"""The way back of a sweep whose gradients are there already, with more stress to scatter."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import prange

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.fixed.lanes import lane_operations
from solidsph.engines.compiled.fixed.partition import buffered
from solidsph.engines.compiled.jit import njit


@cache
def added_stress_pass(dimension: int, stress_at: Any, threaded: bool) -> Any:
    """Compiled (table, rows, H (d, d, m), S (d, d, m), params, history, step, factors, buffers,
    forces (n, d)): forces of the stress at H and of -S, for m >= n.

    `stress_at` is one of `fixed/stress_at.py`.
    """
    d, D = dimension, STRIDE[dimension]
    _, scatter, _, _, margin, plane = block_loops(d, "float64")
    _, cleared, total = buffered(d, "float64", threaded)
    tensor_at = _TENSOR[d]

    @njit
    def sweep(rows, first, last, H, S, params, history, step, factors, f, shift):
        scratch = np.zeros(d * plane)
        flat, stride = H.reshape(-1), H.shape[2]
        for block in range(first, last):
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                p = start + slot
                T = stress_at(p, tensor_at(flat, stride, p), params, history, step)
                at = (margin + slot) * D
                for i in range(d):
                    for k in range(d):
                        scratch[k * plane + at + i] = T[i][k] * factors[p] - S[i, k, p]
            scatter(rows, block, scratch, f, shift)

    @njit(parallel=threaded)
    def forces(table, rows, H, S, params, history, step, factors, buffers, out):
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            sweep(rows, first, last, H, S, params, history, step, factors, buffers, shift)
        total(table, buffers, out)

    return forces


_get_1, _get_2, _get_3 = (lane_operations("float64", None, d * d).get for d in (1, 2, 3))


@njit
def _tensor_1(array, stride, at):
    return (_get_1(array, at, stride),)


@njit
def _tensor_2(array, stride, at):
    H = _get_2(array, at, stride)
    return H[:2], H[2:]


@njit
def _tensor_3(array, stride, at):
    H = _get_3(array, at, stride)
    return H[:3], H[3:6], H[6:]


_TENSOR = {1: _tensor_1, 2: _tensor_2, 3: _tensor_3}
