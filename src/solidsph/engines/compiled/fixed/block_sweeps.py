"""Loops over the blocks `first` to `last` of rows, from displacements to stress and from stress to
forces.

`u` and `f` are flat fields; in `f` particle 0 would stand at `shift`. `factors` (n,) multiply the
stress.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.jit import njit


@cache
def force_sweep(dimension: int, dtype: str, apply: Any) -> Any:
    """Loop (rows, first, last, u, params, factors, f, shift, history (n, k), step): f += from u at
    once, for the law over a block, of `fixed/block_law.py`."""
    d = dimension
    gather, scatter, _, _, _, plane = block_loops(dimension, dtype)

    @njit
    def forces(rows, first, last, u, params, factors, f, shift, history, step):
        scratch = np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            start, size = rows.blocks[block, 0], rows.blocks[block, 1]
            apply(scratch, start, size, params, factors, history, step)
            scatter(rows, block, scratch, f, shift)

    return forces


@cache
def stress_sweep(dimension: int, dtype: str, law: Any) -> Any:
    """Loop (rows, first, last, u, params, stress (d, d, n)): stress from u, for a compiled law
    (H, params) -> T."""
    d = dimension
    gather, _, tensor, _, _, plane = block_loops(dimension, dtype)

    @njit
    def stress(rows, first, last, u, params, out):
        scratch = np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                T = law(tensor(scratch, slot), params)
                for i in range(d):
                    for k in range(d):
                        out[i, k, start + slot] = T[i][k]

    return stress


@cache
def rate_sweep(dimension: int, dtype: str, law: Any) -> Any:
    """Loop (rows, first, last, u, v, params, factors, f, shift): f += from displacements u and
    velocities v, for a law (H, dH/dt, params) -> T."""
    d = dimension
    gather, scatter, tensor, put, _, plane = block_loops(dimension, dtype)

    @njit
    def forces(rows, first, last, u, v, params, factors, f, shift):
        scratch, rates = np.zeros(d * plane, u.dtype), np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            gather(rows, block, v, rates)
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                T = law(tensor(scratch, slot), tensor(rates, slot), params)
                put(scratch, slot, T, factors[start + slot])
            scatter(rows, block, scratch, f, shift)

    return forces


@cache
def spread_sweep(dimension: int, dtype: str) -> Any:
    """Loop (rows, first, last, stress (d, d, n), factors, f, shift): f += from stress."""
    d, D = dimension, STRIDE[dimension]
    _, scatter, _, _, margin, plane = block_loops(dimension, dtype)

    @njit
    def spread(rows, first, last, stress, factors, f, shift):
        scratch = np.zeros(d * plane, f.dtype)
        for block in range(first, last):
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                for i in range(d):
                    for k in range(d):
                        T = stress[i, k, start + slot] * factors[start + slot]
                        scratch[k * plane + (margin + slot) * D + i] = T
            scatter(rows, block, scratch, f, shift)

    return spread
