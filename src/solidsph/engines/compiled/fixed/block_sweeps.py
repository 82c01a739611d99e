"""Loops over blocks of rows, from displacements to stress and from stress to forces."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.blocks import block_loops
from solidsph.engines.compiled.jit import njit


class BlockSweeps(NamedTuple):
    """Compiled loops over the blocks `first` to `last` of `rows`.

    `u` and `f` are flat fields; in `f` particle 0 would stand at `shift`. `factors` (n,) multiply
    the stress.
    """

    forces: Any  # (rows, first, last, u, params, factors, f, shift): f += from u, at once
    stress: Any  # (rows, first, last, u, params, stress (d, d, n)): stress from u


@cache
def block_sweeps(dimension: int, dtype: str, law: Any) -> BlockSweeps:
    """Loops for one dimension, number type and compiled law (H, params) -> T."""
    d = dimension
    gather, scatter, tensor, put, _, plane = block_loops(dimension, dtype)

    @njit
    def forces(rows, first, last, u, params, factors, f, shift):
        scratch = np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                T = law(tensor(scratch, slot), params)
                put(scratch, slot, T, factors[start + slot])
            scatter(rows, block, scratch, f, shift)

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

    return BlockSweeps(forces, stress)


@cache
def history_sweep(dimension: int, dtype: str, law: Any, count: int) -> Any:
    """Loop (rows, first, last, u, params, factors, f, shift, history (n, k), step): f += from u,
    and the history at the end of the step, for a law (H, h, step, params) -> (T, h)."""
    d = dimension
    gather, scatter, tensor, put, _, plane = block_loops(dimension, dtype)

    @njit
    def forces(rows, first, last, u, params, factors, f, shift, history, step):
        scratch = np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            start, size = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(size):
                p = start + slot
                h = to_fixed_tuple(history[p], count)
                T, h = law(tensor(scratch, slot), h, step, params)
                for k in range(count):
                    history[p, k] = h[k]
                put(scratch, slot, T, factors[p])
            scatter(rows, block, scratch, f, shift)

    return forces


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
