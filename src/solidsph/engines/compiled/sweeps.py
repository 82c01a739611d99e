"""Sweeps over rows: gather the gradient, apply the law, scatter the force.

Fields are kept flat, with 1, 2 or 4 numbers a particle in 1, 2 or 3 dimensions: one layout in which
a vector register holds either one neighbour's values or those of several particles that follow
each other. A block of particles has its tensors in a scratch array of d planes, plane k holding
column k of the tensors in the same layout; a margin of zeros on both sides lets loops overrun it.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from solidsph.engines.compiled.lanes import register_bytes, words
from solidsph.engines.compiled.rows import BAND, RUN

STRIDE = {1: 1, 2: 2, 3: 4}  # numbers kept for a particle, by dimension
_GROUP = 4  # vector registers of particles that go through a stencil together


def particles_in_group(dimension: int, dtype: str) -> int:
    """How many particles of a run go through its stencil together."""
    return _GROUP * _lanes(dimension, dtype) // STRIDE[dimension]


def _lanes(dimension: int, dtype: str) -> int:
    return max(register_bytes() // np.dtype(dtype).itemsize, STRIDE[dimension])


class Sweeps(NamedTuple):
    """Compiled loops over blocks `first` to `last` of rows; `u`, `f` and `stress` are arrays.

    `shift` is where particle 0 would stand in `f`, which may begin at a later one.
    """

    # (rows, first, last, u, law's params, factors, f, shift): gather, law and scatter at once
    forces: Any
    # (rows, first, last, u, law's params, stress (d, d, n)): gather and law
    stress: Any
    # (rows, first, last, stress (d, d, n), factors, f, shift): scatter
    spread: Any


@cache
def sweeps(dimension: int, dtype: str, law: Any) -> Sweeps:
    """Loops for one dimension, number type and compiled law (H, params) -> T."""
    d, D = dimension, STRIDE[dimension]
    W = _lanes(d, dtype)
    G = particles_in_group(d, dtype)
    margin = BAND + G
    slots = margin + RUN + margin
    plane = slots * D
    one = _columns(d, dtype, D)  # a particle's numbers
    many = _columns(d, dtype, W)  # those of several particles
    load, store = many.load, many.store

    @njit(forceinline=True)
    def gather_run(rows, first, count, stencil, u, scratch):  # type: ignore[no-untyped-def]
        begin, end = rows.members[stencil], rows.members[stencil + 1]
        for slot in range(0, count, G):
            h0 = many.zeros()
            h1 = many.zeros()
            h2 = many.zeros()
            h3 = many.zeros()
            for m in range(begin, end):
                g = many.weight(rows.stencil_weights, m)
                at = (first + slot + rows.offsets[m]) * D
                h0 = many.outer(h0, load(u, at), g)
                h1 = many.outer(h1, load(u, at + W), g)
                h2 = many.outer(h2, load(u, at + 2 * W), g)
                h3 = many.outer(h3, load(u, at + 3 * W), g)
            at = (margin + slot) * D
            many.put(scratch, at, plane, h0)
            many.put(scratch, at + W, plane, h1)
            many.put(scratch, at + 2 * W, plane, h2)
            many.put(scratch, at + 3 * W, plane, h3)

    @njit(forceinline=True)
    def gather_rows(rows, count, row, u, scratch):  # type: ignore[no-untyped-def]
        for slot in range(count):
            m, end = rows.starts[row + slot], rows.starts[row + slot + 1]
            # Two sums side by side: each must wait for its last addition.
            h, other = one.zeros(), one.zeros()
            while m + 1 < end:
                g = one.weight(rows.weights, m)
                h = one.outer(h, one.load(u, rows.columns[m] * D), g)
                g = one.weight(rows.weights, m + 1)
                other = one.outer(other, one.load(u, rows.columns[m + 1] * D), g)
                m += 2
            if m < end:
                g = one.weight(rows.weights, m)
                h = one.outer(h, one.load(u, rows.columns[m] * D), g)
            one.put(scratch, (margin + slot) * D, plane, one.sum(h, other))

    @njit(forceinline=True)
    def gather(rows, block, u, scratch):  # type: ignore[no-untyped-def]
        first, count, where = rows.blocks[block]
        if where >= 0:
            gather_run(rows, first, count, where, u, scratch)
        else:
            gather_rows(rows, count, -1 - where, u, scratch)

    @njit(forceinline=True)
    def scatter_run(rows, first, count, stencil, scratch, f, shift):  # type: ignore[no-untyped-def]
        # Members that follow each other add to the same particles: those sums stay in registers,
        # and the tensors move past them.
        for band in range(rows.stencils[stencil], rows.stencils[stencil + 1]):
            member, offset, width = rows.bands[band]
            for slot in range(0, count + width - 1, G):
                to = (first + offset + slot) * D + shift
                f0, f1, f2, f3 = load(f, to), load(f, to + W), load(f, to + 2 * W), load(f, to + 3 * W)
                for k in range(width):
                    g = many.weight(rows.stencil_weights, member + k)
                    at = (margin + slot - k) * D
                    f0 = many.inner(f0, many.get(scratch, at, plane), g)
                    f1 = many.inner(f1, many.get(scratch, at + W, plane), g)
                    f2 = many.inner(f2, many.get(scratch, at + 2 * W, plane), g)
                    f3 = many.inner(f3, many.get(scratch, at + 3 * W, plane), g)
                store(f, to, f0)
                store(f, to + W, f1)
                store(f, to + 2 * W, f2)
                store(f, to + 3 * W, f3)

    @njit(forceinline=True)
    def scatter_rows(rows, count, row, scratch, f, shift):  # type: ignore[no-untyped-def]
        for slot in range(count):
            a = one.get(scratch, (margin + slot) * D, plane)
            for m in range(rows.starts[row + slot], rows.starts[row + slot + 1]):
                to = rows.columns[m] * D + shift
                g = one.weight(rows.weights, m)
                one.store(f, to, one.inner(one.load(f, to), a, g))

    @njit(forceinline=True)
    def scatter(rows, block, scratch, f, shift):  # type: ignore[no-untyped-def]
        first, count, where = rows.blocks[block]
        if where >= 0:
            scratch_clear(scratch, count)
            scatter_run(rows, first, count, where, scratch, f, shift)
        else:
            scatter_rows(rows, count, -1 - where, scratch, f, shift)

    @njit(forceinline=True)
    def scratch_clear(scratch, count):  # type: ignore[no-untyped-def]
        # What an earlier block, or an overrun, has left behind the last particle.
        for k in range(d):
            scratch[k * plane + (margin + count) * D : k * plane + (2 * margin + count) * D] = 0.0

    tensor_at, put_tensor = _tensors(d)

    @njit
    def forces(rows, first, last, u, params, factors, f, shift):  # type: ignore[no-untyped-def]
        scratch = np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                at = (margin + slot) * D
                T = law(tensor_at(scratch, at, plane), params)
                put_tensor(scratch, at, plane, T, factors[start + slot])
            scatter(rows, block, scratch, f, shift)

    @njit
    def stress(rows, first, last, u, params, out):  # type: ignore[no-untyped-def]
        scratch = np.zeros(d * plane, u.dtype)
        for block in range(first, last):
            gather(rows, block, u, scratch)
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                T = law(tensor_at(scratch, (margin + slot) * D, plane), params)
                for i in range(d):
                    for k in range(d):
                        out[i, k, start + slot] = T[i][k]

    @njit
    def spread(rows, first, last, stress, factors, f, shift):  # type: ignore[no-untyped-def]
        scratch = np.zeros(d * plane, f.dtype)
        for block in range(first, last):
            start, count = rows.blocks[block, 0], rows.blocks[block, 1]
            for slot in range(count):
                for i in range(d):
                    for k in range(d):
                        value = stress[i, k, start + slot] * factors[start + slot]
                        scratch[k * plane + (margin + slot) * D + i] = value
            scatter(rows, block, scratch, f, shift)

    return Sweeps(forces, stress, spread)


class _Columns(NamedTuple):
    """Words for tensors whose columns are lanes: tuples of d of them, unrolled by hand."""

    load: Any
    store: Any
    zeros: Any  # () -> tensor
    weight: Any  # (weights (m, d), m) -> g, each component spread over all lanes
    outer: Any  # (h, u, g) -> h + u (x) g
    inner: Any  # (f, T, g) -> f + T g
    sum: Any  # (h, other) -> their sum
    put: Any  # (scratch, at, plane, h)
    get: Any  # (scratch, at, plane) -> tensor


@cache
def _columns(dimension: int, dtype: str, lanes: int) -> _Columns:
    load, store, same, add_product = words(dtype, lanes)
    number = np.dtype(dtype).type
    nought, unit = number(0.0), number(1.0)

    if dimension == 1:

        @njit(forceinline=True)
        def zeros():  # type: ignore[no-untyped-def]
            return (same(nought),)

        @njit(forceinline=True)
        def weight(g, m):  # type: ignore[no-untyped-def]
            return (same(g[m, 0]),)

        @njit(forceinline=True)
        def outer(h, u, g):  # type: ignore[no-untyped-def]
            return (add_product(h[0], u, g[0]),)

        @njit(forceinline=True)
        def inner(f, T, g):  # type: ignore[no-untyped-def]
            return add_product(f, T[0], g[0])

        @njit(forceinline=True)
        def put(scratch, at, plane, h):  # type: ignore[no-untyped-def]
            store(scratch, at, h[0])

        @njit(forceinline=True)
        def get(scratch, at, plane):  # type: ignore[no-untyped-def]
            return (load(scratch, at),)

    elif dimension == 2:

        @njit(forceinline=True)
        def zeros():  # type: ignore[no-untyped-def]
            return (same(nought), same(nought))

        @njit(forceinline=True)
        def weight(g, m):  # type: ignore[no-untyped-def]
            return (same(g[m, 0]), same(g[m, 1]))

        @njit(forceinline=True)
        def outer(h, u, g):  # type: ignore[no-untyped-def]
            return (add_product(h[0], u, g[0]), add_product(h[1], u, g[1]))

        @njit(forceinline=True)
        def inner(f, T, g):  # type: ignore[no-untyped-def]
            return add_product(add_product(f, T[0], g[0]), T[1], g[1])

        @njit(forceinline=True)
        def put(scratch, at, plane, h):  # type: ignore[no-untyped-def]
            store(scratch, at, h[0])
            store(scratch, at + plane, h[1])

        @njit(forceinline=True)
        def get(scratch, at, plane):  # type: ignore[no-untyped-def]
            return (load(scratch, at), load(scratch, at + plane))

    else:

        @njit(forceinline=True)
        def zeros():  # type: ignore[no-untyped-def]
            return (same(nought), same(nought), same(nought))

        @njit(forceinline=True)
        def weight(g, m):  # type: ignore[no-untyped-def]
            return (same(g[m, 0]), same(g[m, 1]), same(g[m, 2]))

        @njit(forceinline=True)
        def outer(h, u, g):  # type: ignore[no-untyped-def]
            return (
                add_product(h[0], u, g[0]),
                add_product(h[1], u, g[1]),
                add_product(h[2], u, g[2]),
            )

        @njit(forceinline=True)
        def inner(f, T, g):  # type: ignore[no-untyped-def]
            return add_product(add_product(add_product(f, T[0], g[0]), T[1], g[1]), T[2], g[2])

        @njit(forceinline=True)
        def put(scratch, at, plane, h):  # type: ignore[no-untyped-def]
            store(scratch, at, h[0])
            store(scratch, at + plane, h[1])
            store(scratch, at + 2 * plane, h[2])

        @njit(forceinline=True)
        def get(scratch, at, plane):  # type: ignore[no-untyped-def]
            return (load(scratch, at), load(scratch, at + plane), load(scratch, at + 2 * plane))

    @njit(forceinline=True)
    def sum_of(h, other):  # type: ignore[no-untyped-def]
        ones = same(unit)
        total = ()
        return total

    return _Columns(load, store, zeros, weight, outer, inner, sum_of, put, get)
