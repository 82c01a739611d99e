"""The way back of a sweep whose gradients are there already, with more stress to scatter."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import prange

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.fixed.partition import buffered
from solidsph.engines.compiled.jit import njit


@cache
def added_stress_pass(dimension: int, apply: Any, threaded: bool) -> Any:
    """Compiled (table, rows, H (d, d, m), S (d, d, m), params, history, step, factors, buffers,
    forces (n, d)): forces of the stress at H and of -S, for m >= n.

    `apply` is a law over a block, of `fixed/block_law.py`.
    """
    d, D = dimension, STRIDE[dimension]
    _, scatter, _, _, margin, plane = block_loops(d, "float64")
    _, cleared, total = buffered(d, "float64", threaded)

    @njit
    def sweep(rows, first, last, H, S, params, history, step, factors, f, shift):
        scratch = np.zeros(d * plane)
        for block in range(first, last):
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for i in range(d):
                for k in range(d):
                    at = k * plane + margin * D + i
                    for slot in range(count):
                        scratch[at + slot * D] = H[i, k, start + slot]
            apply(scratch, start, count, params, factors, history, step)
            for i in range(d):
                for k in range(d):
                    at = k * plane + margin * D + i
                    for slot in range(count):
                        scratch[at + slot * D] -= S[i, k, start + slot]
            scatter(rows, block, scratch, f, shift)

    @njit(parallel=threaded)
    def forces(table, rows, H, S, params, history, step, factors, buffers, out):
        for t in prange(len(table)):
            cleared(table[t], buffers)
            first, last, shift = table[t, 0], table[t, 1], table[t, 4]
            sweep(rows, first, last, H, S, params, history, step, factors, buffers, shift)
        total(table, buffers, out)

    return forces
