"""Lanes: consecutive numbers of an array, loaded and multiplied as one (explicit SIMD).

The vectorisation is not left to the compiler: sums over neighbours keep their accumulators in
vector registers only if they are written so. If the registers of a machine are narrower than the
lanes, LLVM uses several.

A field of vectors is flat; so are the d planes of a field of tensors, with column k in plane k.
Loops treat vectors as lanes, and tensors as tuples of d lanes, one per column.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding, ir
from numba import types
from numba.core.datamodel import models
from numba.core.typeconv import Conversion
from numba.extending import intrinsic, lower_cast, register_model
from numba.np.numpy_support import from_dtype


class Lanes(types.Type):
    """The compiler's type of `count` numbers of one kind."""

    def __init__(self, element: Any, count: int) -> None:
        self.element, self.count = element, count
        super().__init__(name=f"Lanes({element}, {count})")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A number becomes lanes where a formula has one or the other."""
        return Conversion.promote if self._takes(other) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """The type of what is lanes in one branch of a formula and a number in the other."""
        return self if self._takes(other) else None

    def _takes(self, other: Any) -> bool:
        return isinstance(other, types.Number) and self.element == types.float64


def lanes_type(dimension: int, count: int) -> Any:
    """The compiler's type of a vector of lanes, `count` numbers each."""
    return types.UniTuple(Lanes(types.float64, count), dimension)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        element = manager.lookup(lanes.element).get_value_type()
        super().__init__(manager, lanes, ir.VectorType(element, lanes.count))


class LaneOperations(NamedTuple):
    """Operations on lanes for compiled loops; `at` is an index into a flat array."""

    load: Any  # (array, at) -> vector
    store: Any  # (array, at, vector)
    zeros: Any  # () -> tensor
    weight: Any  # (weights (m, d), row) -> g: each component spread over all lanes
    outer: Any  # (h, u, g) -> h + u (x) g
    inner: Any  # (f, T, g) -> f + T g
    total: Any  # (h, other) -> their sum
    put: Any  # (array, at, plane, tensor)
    get: Any  # (array, at, plane) -> tensor


def spread(context: Any, builder: Any, number: Any, lanes: Lanes) -> Any:
    """Lanes of one number, the builder's way."""
    empty = ir.Constant(context.get_value_type(lanes), ir.Undefined)
    first = builder.insert_element(empty, number, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), lanes.count), [0] * lanes.count)
    return builder.shuffle_vector(first, empty, everywhere)


@cache
def register_bytes() -> int:
    """Width of the vector registers of this machine [bytes]."""
    features = binding.get_host_cpu_features()
    if features.get("avx512f"):
        return 64
    return 32 if features.get("avx") else 16


@lower_cast(types.Number, Lanes)
def _from_number(context: Any, builder: Any, number: Any, lanes: Any, value: Any) -> Any:
    return spread(context, builder, context.cast(builder, value, number, lanes.element), lanes)


def laid(context: Any, builder: Any, kind: Any, value: Any, lanes: Lanes) -> Any:
    """A value of a type `kind` as lanes of doubles, the builder's way."""
    if not isinstance(kind, Lanes):
        number = context.cast(builder, value, kind, lanes.element)
        return spread(context, builder, number, lanes)
    if kind.element == types.boolean:
        return builder.uitofp(value, context.get_value_type(lanes))
    return value


@cache
def lane_operations(dtype: str, count: int | None, dimension: int) -> LaneOperations:
    """The operations for lanes of `count` numbers of type `dtype`, and tensors of a dimension.

    Without a count they are for single numbers.
    """
    element = from_dtype(np.dtype(dtype))
    lanes = element if count is None else Lanes(element, count)
    tensor = types.UniTuple(lanes, dimension)
    size = np.dtype(dtype).itemsize
    axes = range(dimension)

    def address(context: Any, builder: Any, array_type: Any, array: Any, at: Any) -> Any:
        data = context.make_array(array_type)(context, builder, array).data
        return builder.gep(data, [at])

    def lanes_at(context: Any, builder: Any, array_type: Any, array: Any, at: Any) -> Any:
        vector = context.get_value_type(lanes)
        return builder.bitcast(
            address(context, builder, array_type, array, at), vector.as_pointer()
        )

    def built(context: Any, builder: Any, column: Callable[[int], Any]) -> Any:
        value = ir.Constant(context.get_value_type(tensor), ir.Undefined)
        for k in axes:
            value = builder.insert_value(value, column(k), k)
        return value

    def add_product(builder: Any, a: Any, b: Any, c: Any) -> Any:
        # May be rounded once by a fused multiply-add; nothing else is reordered.
        product = builder.fmul(b, c, flags=("contract",))
        return builder.fadd(a, product, flags=("contract",))

    @intrinsic
    def load(typing: Any, array: Any, at: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.load(lanes_at(context, builder, signature.args[0], *args), align=size)

        return lanes(array, types.intp), code

    @intrinsic
    def store(typing: Any, array: Any, at: Any, vector: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, at, value = args
            target = lanes_at(context, builder, signature.args[0], array, at)
            builder.store(value, target, align=size)
            return context.get_dummy_value()

        return types.void(array, types.intp, lanes), code

    @intrinsic
    def zeros(typing: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return ir.Constant(context.get_value_type(tensor), None)

        return tensor(), code

    @intrinsic
    def weight(typing: Any, weights: Any, row: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            first = builder.mul(args[1], ir.Constant(args[1].type, dimension))

            def component(k: int) -> Any:
                at = builder.add(first, ir.Constant(first.type, k))
                where = address(context, builder, signature.args[0], args[0], at)
                return spread(context, builder, builder.load(where, align=size), lanes)

            return built(context, builder, component)

        return tensor(weights, types.intp), code

    @intrinsic
    def outer(typing: Any, h: Any, u: Any, g: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            h, u, g = args
            part = builder.extract_value
            return built(
                context, builder, lambda k: add_product(builder, part(h, k), u, part(g, k))
            )

        return tensor(tensor, lanes, tensor), code

    @intrinsic
    def inner(typing: Any, f: Any, T: Any, g: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            f, T, g = args
            part = builder.extract_value
            for k in axes:
                f = add_product(builder, f, part(T, k), part(g, k))
            return f

        return lanes(lanes, tensor, tensor), code

    @intrinsic
    def total(typing: Any, h: Any, other: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            def sum_of(k: int) -> Any:
                a, b = (builder.extract_value(one, k) for one in args)
                return builder.fadd(a, b, flags=("contract",))

            return built(context, builder, sum_of)

        return tensor(tensor, tensor), code

    @intrinsic
    def put(typing: Any, array: Any, at: Any, plane: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, at, plane, value = args
            for k in axes:
                target = lanes_at(context, builder, signature.args[0], array, at)
                builder.store(builder.extract_value(value, k), target, align=size)
                at = builder.add(at, plane)
            return context.get_dummy_value()

        return types.void(array, types.intp, types.intp, tensor), code

    @intrinsic
    def get(typing: Any, array: Any, at: Any, plane: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, first, plane = args

            def column(k: int) -> Any:
                at = builder.add(first, builder.mul(plane, ir.Constant(plane.type, k)))
                source = lanes_at(context, builder, signature.args[0], array, at)
                return builder.load(source, align=size)

            return built(context, builder, column)

        return tensor(array, types.intp, types.intp), code

    return LaneOperations(load, store, zeros, weight, outer, inner, total, put, get)
