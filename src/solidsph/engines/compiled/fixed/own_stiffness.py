"""Stiffness of every particle against its own displacement, from rows of weights."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from solidsph.engines.compiled.jit import njit


@cache
def own_stiffness_pass(dimension: int) -> Any:
    """Compiled (rows, factors (n,), moduli (n, d d, d d), blocks (n, d, d)): blocks -= the sums
    over p of factor_p g_pq,k A_p,ikjl g_pq,l at q."""
    d = dimension

    @njit(error_model="numpy")
    def add(A, g, block):
        for i in range(d):
            for j in range(d):
                total = 0.0
                for k in range(d):
                    for l in range(d):  # noqa: E741
                        total += g[k] * A[i, k, j, l] * g[l]
                block[i, j] -= total

    @njit(error_model="numpy")
    def run(rows, factors, moduli, blocks):
        A = np.empty((d, d, d, d))
        g = np.empty(d)
        for b in range(len(rows.blocks)):
            first, count, where = rows.blocks[b]
            for slot in range(count):
                p = first + slot
                for i in range(d):
                    for k in range(d):
                        for j in range(d):
                            for l in range(d):  # noqa: E741
                                A[i, k, j, l] = factors[p] * moduli[p, i * d + k, j * d + l]
                if where >= 0:
                    for m in range(rows.members[where], rows.members[where + 1]):
                        for k in range(d):
                            g[k] = rows.stencil_weights[m, k]
                        add(A, g, blocks[p + rows.offsets[m]])
                else:
                    begin, end = rows.spans[-1 - where + slot]
                    for m in range(begin, end):
                        for k in range(d):
                            g[k] = rows.row_weights[m, k]
                        add(A, g, blocks[p + rows.row_offsets[m]])

    return run
