"""Tensors and internal variables of consecutive particles, as lanes of doubles.

A pointwise function that takes them so is evaluated for as many particles at once as a register
holds. Lanes beyond the last particle have what the first one has, so that iterations end for them
too, and leave nothing behind.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from solidsph.engines.compiled.constants import STRIDE
from solidsph.engines.compiled.fixed.lanes import Lanes, laid, register_bytes

WIDTH = register_bytes() // 8
"""Number of particles."""


class LaneTensors(NamedTuple):
    """Compiled; `left` is the number of particles from the first lane on."""

    get: Any  # (scratch, at, plane, left) -> tensor, from the scratch array of `fixed/blocks.py`
    put: Any  # (scratch, at, plane, T, factors, p): factors[p ...] T
    numbers: Any  # (array (n, count), p, left) -> tuple of `count` lanes
    keep: Any  # (array (n, count), p, left, tuple)


@cache
def lane_tensors(dimension: int, dtype: str, count: int) -> LaneTensors:
    """The operations for one dimension, type of the scratch array, and number of variables."""
    D = STRIDE[dimension]
    size, narrow = np.dtype(dtype).itemsize, dtype == "float32"
    lanes = Lanes(types.float64, WIDTH)
    axes = range(dimension)
    tensor = types.UniTuple(types.UniTuple(lanes, dimension), dimension)

    # Types of the builder by functions: what compiled functions hold has to have a content.
    def doubles() -> Any:
        return ir.VectorType(ir.DoubleType(), WIDTH)

    def stored() -> Any:
        return ir.VectorType(ir.FloatType(), WIDTH) if narrow else doubles()

    def target(context: Any, builder: Any, kind: Any, array: Any, at: Any, vector: Any) -> Any:
        data = context.make_array(kind)(context, builder, array).data
        return builder.bitcast(builder.gep(data, [at]), vector.as_pointer())

    def among(builder: Any, left: Any) -> Any:
        """Which lanes are of a particle."""
        whole = ir.VectorType(ir.IntType(64), WIDTH)
        return builder.icmp_signed(
            "<", ir.Constant(whole, list(range(WIDTH))), _everywhere(builder, left)
        )

    def filled(builder: Any, value: Any, valid: Any) -> Any:
        first = builder.extract_element(value, ir.Constant(ir.IntType(32), 0))
        return builder.select(valid, value, _everywhere(builder, first))

    def tupled(context: Any, builder: Any, kind: Any, values: Sequence[Any]) -> Any:
        made = ir.Constant(context.get_value_type(kind), ir.Undefined)
        for k, value in enumerate(values):
            made = builder.insert_value(made, value, k)
        return made

    @intrinsic
    def get(typing: Any, scratch: Any, at: Any, plane: Any, left: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            scratch, at, plane, left = args
            valid, columns = among(builder, left), []
            for _ in axes:
                parts = []
                for part in range(D):
                    where = builder.add(at, ir.Constant(at.type, part * WIDTH))
                    source = target(context, builder, signature.args[0], scratch, where, stored())
                    parts.append(builder.load(source, align=size))
                column = [_every(builder, parts, D, i) for i in axes]
                if narrow:
                    column = [builder.fpext(one, doubles()) for one in column]
                columns.append([filled(builder, one, valid) for one in column])
                at = builder.add(at, plane)
            rows = [
                tupled(context, builder, tensor.dtype, [columns[k][i] for k in axes]) for i in axes
            ]
            return tupled(context, builder, tensor, rows)

        return tensor(scratch, types.intp, types.intp, types.intp), code

    @intrinsic
    def put(typing: Any, scratch: Any, at: Any, plane: Any, T: Any, factors: Any, p: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            scratch, at, plane, T, factors, p = args
            source = target(context, builder, signature.args[4], factors, p, stored())
            factor = builder.load(source, align=size)
            factor = builder.fpext(factor, doubles()) if narrow else factor
            for k in axes:
                column = []
                for i in axes:
                    row = builder.extract_value(T, i)
                    kind = signature.args[3].types[i].types[k]
                    value = laid(context, builder, kind, builder.extract_value(row, k), lanes)
                    value = builder.fmul(value, factor)
                    column.append(builder.fptrunc(value, stored()) if narrow else value)
                column += [ir.Constant(stored(), None)] * (D - dimension)
                for part, value in enumerate(_interleaved(builder, column)):
                    where = builder.add(at, ir.Constant(at.type, part * WIDTH))
                    place = target(context, builder, signature.args[0], scratch, where, stored())
                    builder.store(value, place, align=size)
                at = builder.add(at, plane)
            return context.get_dummy_value()

        return types.void(scratch, types.intp, types.intp, T, factors, types.intp), code

    def variable(context: Any, builder: Any, kind: Any, array: Any, p: Any, k: int) -> Any:
        """The place of a variable of particle p, whose variables are in planes."""
        made = context.make_array(kind)(context, builder, array)
        stride = builder.extract_value(made.strides, 1)
        offset = builder.mul(stride, ir.Constant(stride.type, k))
        base = builder.bitcast(made.data, ir.IntType(8).as_pointer())
        plane = builder.bitcast(builder.gep(base, [offset]), ir.DoubleType().as_pointer())
        return builder.gep(plane, [p])

    @intrinsic
    def numbers(typing: Any, array: Any, p: Any, left: Any) -> Any:
        found = types.UniTuple(lanes, count)

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, p, left = args
            valid, values = among(builder, left), []
            for k in range(count):
                place = variable(context, builder, signature.args[0], array, p, k)
                value = builder.load(builder.bitcast(place, doubles().as_pointer()), align=8)
                values.append(filled(builder, value, valid))
            return tupled(context, builder, found, values)

        return found(array, types.intp, types.intp), code

    @intrinsic
    def keep(typing: Any, array: Any, p: Any, left: Any, values: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, p, left, values = args
            places, found = [], []
            for k in range(count):
                value, kind = builder.extract_value(values, k), signature.args[3].types[k]
                found.append(laid(context, builder, kind, value, lanes))
                places.append(variable(context, builder, signature.args[0], array, p, k))
            full = builder.icmp_signed(">=", left, ir.Constant(left.type, WIDTH))
            with builder.if_else(full) as (of_all, of_some):
                with of_all:
                    for place, value in zip(places, found, strict=True):
                        vectors = builder.bitcast(place, doubles().as_pointer())
                        builder.store(value, vectors, align=8)
                with of_some:
                    for lane in range(WIDTH):
                        is_there = builder.icmp_signed("<", ir.Constant(left.type, lane), left)
                        with builder.if_then(is_there):
                            for place, value in zip(places, found, strict=True):
                                one = builder.extract_element(
                                    value, ir.Constant(ir.IntType(32), lane)
                                )
                                builder.store(one, builder.gep(place, [ir.Constant(p.type, lane)]))
            return context.get_dummy_value()

        return types.void(array, types.intp, types.intp, values), code

    return LaneTensors(get, put, numbers, keep)


def _everywhere(builder: Any, number: Any) -> Any:
    """Lanes of one number."""
    kind = ir.VectorType(number.type, WIDTH)
    empty = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(empty, number, ir.Constant(ir.IntType(32), 0))
    return _shuffled(builder, first, first, [0] * WIDTH)


def _shuffled(builder: Any, a: Any, b: Any, mask: Sequence[int]) -> Any:
    places = ir.Constant(ir.VectorType(ir.IntType(32), len(mask)), list(mask))
    return builder.shuffle_vector(a, b, places)


def _every(builder: Any, parts: Sequence[Any], stride: int, first: int) -> Any:
    """Numbers `first`, `first` + `stride`, ... of registers side by side."""
    held: list[tuple[Any, list[int]]] = []
    for r, part in enumerate(parts):
        places = [k for k in range(WIDTH) if (r * WIDTH + k) % stride == first]
        if places:
            held.append((part, places))
    while len(held) > 1:
        # Two by two, from the left; what is not used repeats the first number.
        pairs = [held[k : k + 2] for k in range(0, len(held), 2)]
        held = []
        for (a, of_a), (b, of_b) in pairs:
            mask = [*of_a, *(WIDTH + k for k in of_b)]
            whole = mask + [0] * (WIDTH - len(mask))
            held.append((_shuffled(builder, a, b, whole), list(range(len(mask)))))
    ((found, places),) = held
    return found if places == list(range(WIDTH)) else _shuffled(builder, found, found, places)


def _interleaved(builder: Any, columns: Sequence[Any]) -> Sequence[Any]:
    """Registers of what 1, 2 or 4 columns have of one particle after the other."""
    unit, rows = 1, [[column] for column in columns]
    while len(rows) > 1:
        rows = [_merged(builder, a, b, unit) for a, b in zip(rows[::2], rows[1::2], strict=True)]
        unit *= 2
    return rows[0]


def _merged(builder: Any, a: Sequence[Any], b: Sequence[Any], unit: int) -> list[Any]:
    """Units of a and of b by turns."""
    order = [
        side * WIDTH + k + j for k in range(0, WIDTH, unit) for side in (0, 1) for j in range(unit)
    ]
    found = []
    for left, right in zip(a, b, strict=True):
        found.append(_shuffled(builder, left, right, order[:WIDTH]))
        found.append(_shuffled(builder, left, right, order[WIDTH:]))
    return found
