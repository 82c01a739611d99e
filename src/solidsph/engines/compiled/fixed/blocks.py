"""Loops over one block of rows: gather the gradient of a field, scatter the force of a stress.

Fields of vectors are flat, with 1, 2 or 4 numbers per particle in 1, 2 or 3 dimensions, so that a
register holds the values of one neighbour or of several consecutive particles. The tensors of the
current block are in a small scratch array with margins of zeros, which loops may overrun.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.lanes import lane_operations, register_bytes
from solidsph.engines.compiled.fixed.rows import BAND, RUN
from solidsph.engines.compiled.jit import njit

_REGISTERS = 4  # of consecutive particles that a stencil is applied to together


def group(dimension: int, dtype: str) -> int:
    """Number of particles of a run that a stencil is applied to together."""
    return _REGISTERS * _lanes(dimension, dtype) // STRIDE[dimension]


def _lanes(dimension: int, dtype: str) -> int:
    return max(register_bytes() // np.dtype(dtype).itemsize, STRIDE[dimension])


class BlockLoops(NamedTuple):
    """Compiled loops, and the layout of the tensors of a block.

    Component T_ik of the particle in a slot is `scratch[k * plane + (margin + slot) * stride + i]`.
    """

    gather: Any  # (rows, block, u, scratch): scratch = gradient of u
    scatter: Any  # (rows, block, scratch, f, shift): f += from scratch; particle 0 is at `shift`
    tensor: Any  # (scratch, slot) -> a particle's tensor, as pointwise functions take it
    put: Any  # (scratch, slot, T, factor): the particle's tensor is `factor` T
    margin: int  # slots
    plane: int  # numbers in a plane of scratch


@cache
def block_loops(dimension: int, dtype: str) -> BlockLoops:
    """The loops for one dimension and number type."""
    d, D = dimension, STRIDE[dimension]
    W, G = _lanes(d, dtype), group(d, dtype)
    margin = BAND + G
    plane = (margin + RUN + margin) * D
    # Operations on several particles, and on one.
    load, store, zeros, weight, outer, inner, _, store_tensor, get = lane_operations(dtype, W, d)
    load_1, store_1, zeros_1, weight_1, outer_1, inner_1, total_1, put_1, get_1 = lane_operations(
        dtype, D, d
    )

    @njit
    def gather_run(rows, first, count, stencil, u, scratch):
        begin, end = rows.members[stencil], rows.members[stencil + 1]
        for slot in range(0, count, G):
            h0, h1, h2, h3 = zeros(), zeros(), zeros(), zeros()
            for m in range(begin, end):
                g = weight(rows.stencil_weights, m)
                at = (first + slot + rows.offsets[m]) * D
                h0 = outer(h0, load(u, at), g)
                h1 = outer(h1, load(u, at + W), g)
                h2 = outer(h2, load(u, at + 2 * W), g)
                h3 = outer(h3, load(u, at + 3 * W), g)
            at = (margin + slot) * D
            store_tensor(scratch, at, plane, h0)
            store_tensor(scratch, at + W, plane, h1)
            store_tensor(scratch, at + 2 * W, plane, h2)
            store_tensor(scratch, at + 3 * W, plane, h3)

    @njit
    def gather_rows(rows, first, count, row, u, scratch):
        for slot in range(count):
            m, end = rows.spans[row + slot]
            # Two sums, because each addition waits for the one before it.
            h, other = zeros_1(), zeros_1()
            while m + 1 < end:
                at = (first + slot + rows.row_offsets[m]) * D
                h = outer_1(h, load_1(u, at), weight_1(rows.row_weights, m))
                m += 1
                at = (first + slot + rows.row_offsets[m]) * D
                other = outer_1(other, load_1(u, at), weight_1(rows.row_weights, m))
                m += 1
            if m < end:
                at = (first + slot + rows.row_offsets[m]) * D
                h = outer_1(h, load_1(u, at), weight_1(rows.row_weights, m))
            put_1(scratch, (margin + slot) * D, plane, total_1(h, other))

    @njit
    def gather(rows, block, u, scratch):
        first, count, where = rows.blocks[block]
        if where >= 0:
            gather_run(rows, first, count, where, u, scratch)
        else:
            gather_rows(rows, first, count, -1 - where, u, scratch)

    @njit
    def scatter_run(rows, first, count, stencil, scratch, f, shift):
        # Clear what an earlier block or an overrun left behind the last particle.
        for k in range(d):
            scratch[k * plane + (margin + count) * D : k * plane + (2 * margin + count) * D] = 0
        # The members of a band add to the same particles, whose sums stay in registers.
        for band in range(rows.stencils[stencil], rows.stencils[stencil + 1]):
            member, offset, width = rows.bands[band]
            for slot in range(0, count + width - 1, G):
                to = (first + offset + slot) * D + shift
                f0, f1 = load(f, to), load(f, to + W)
                f2, f3 = load(f, to + 2 * W), load(f, to + 3 * W)
                for k in range(width):
                    g = weight(rows.stencil_weights, member + k)
                    at = (margin + slot - k) * D
                    f0 = inner(f0, get(scratch, at, plane), g)
                    f1 = inner(f1, get(scratch, at + W, plane), g)
                    f2 = inner(f2, get(scratch, at + 2 * W, plane), g)
                    f3 = inner(f3, get(scratch, at + 3 * W, plane), g)
                store(f, to, f0)
                store(f, to + W, f1)
                store(f, to + 2 * W, f2)
                store(f, to + 3 * W, f3)

    @njit
    def scatter_rows(rows, first, count, row, scratch, f, shift):
        for slot in range(count):
            T = get_1(scratch, (margin + slot) * D, plane)
            begin, end = rows.spans[row + slot]
            for m in range(begin, end):
                to = (first + slot + rows.row_offsets[m]) * D + shift
                store_1(f, to, inner_1(load_1(f, to), T, weight_1(rows.row_weights, m)))

    @njit
    def scatter(rows, block, scratch, f, shift):
        first, count, where = rows.blocks[block]
        if where >= 0:
            scatter_run(rows, first, count, where, scratch, f, shift)
        else:
            scatter_rows(rows, first, count, -1 - where, scratch, f, shift)

    tensor_at = _tensor_at(d, plane)

    @njit
    def tensor(scratch, slot):
        return tensor_at(scratch, (margin + slot) * D)

    @njit
    def put(scratch, slot, T, factor):
        at = (margin + slot) * D
        for i in range(d):
            for k in range(d):
                scratch[k * plane + at + i] = T[i][k] * factor

    return BlockLoops(gather, scatter, tensor, put, margin, plane)


def _tensor_at(dimension: int, plane: int) -> Any:
    """Compiled (scratch, at) -> nested tuples, in double precision."""

    @njit
    def number(scratch, at):
        return np.float64(scratch[at])

    if dimension == 1:
        return njit(lambda scratch, at: ((number(scratch, at),),))
    if dimension == 2:

        @njit
        def row_2(scratch, at):
            return number(scratch, at), number(scratch, at + plane)

        return njit(lambda scratch, at: (row_2(scratch, at), row_2(scratch, at + 1)))

    @njit
    def row_3(scratch, at):
        return number(scratch, at), number(scratch, at + plane), number(scratch, at + 2 * plane)

    return njit(
        lambda scratch, at: (row_3(scratch, at), row_3(scratch, at + 1), row_3(scratch, at + 2))
    )
