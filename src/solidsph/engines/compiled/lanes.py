"""Lanes: several numbers that stand side by side in an array, loaded and multiplied as one.

The compiler is not left to find out what can be done side by side: sums over neighbours keep their
accumulators in vector registers only if they are written so. Where a machine's registers are
narrower than the lanes asked for, LLVM takes several.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding, ir
from numba import types
from numba.core.datamodel import models
from numba.extending import intrinsic, register_model
from numba.np.numpy_support import from_dtype


class Lanes(types.Type):
    """The compiler's type of `count` numbers of one kind."""

    def __init__(self, element: Any, count: int) -> None:
        self.element, self.count = element, count
        super().__init__(name=f"Lanes({element}, {count})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        element = manager.lookup(lanes.element).get_value_type()
        super().__init__(manager, lanes, ir.VectorType(element, lanes.count))


class Words(NamedTuple):
    """What compiled loops say about lanes; `at` counts elements of a flat array."""

    load: Any  # (array, at) -> lanes
    store: Any  # (array, at, lanes)
    spread: Any  # (number) -> lanes, all equal to it
    add_product: Any  # (a, b, c) -> a + b c, rounded once where the machine can


def register_bytes() -> int:
    """Width of this machine's vector registers."""
    features = binding.get_host_cpu_features()
    if features.get("avx512f"):
        return 64
    return 32 if features.get("avx") else 16


@cache
def words(dtype: str, count: int) -> Words:
    """The words for lanes of `count` numbers of type `dtype`."""
    element = from_dtype(np.dtype(dtype))
    lanes = Lanes(element, count)
    size = np.dtype(dtype).itemsize

    def pointer(context: Any, builder: Any, array_type: Any, array: Any, at: Any) -> Any:
        data = context.make_array(array_type)(context, builder, array).data
        return builder.bitcast(
            builder.gep(data, [at]), context.get_value_type(lanes).as_pointer()
        )

    @intrinsic
    def load(typing: Any, array: Any, at: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.load(pointer(context, builder, signature.args[0], *args), align=size)

        return lanes(array, types.intp), code

    @intrinsic
    def store(typing: Any, array: Any, at: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            target = pointer(context, builder, signature.args[0], args[0], args[1])
            builder.store(args[2], target, align=size)
            return context.get_dummy_value()

        return types.void(array, types.intp, lanes), code

    @intrinsic
    def spread(typing: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            empty = ir.Constant(context.get_value_type(lanes), ir.Undefined)
            first = builder.insert_element(empty, args[0], ir.Constant(ir.IntType(32), 0))
            everywhere = ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count)
            return builder.shuffle_vector(first, empty, everywhere)

        return lanes(element), code

    @intrinsic
    def add_product(typing: Any, a: Any, b: Any, c: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            product = builder.fmul(args[1], args[2], flags=("contract",))
            return builder.fadd(args[0], product, flags=("contract",))

        return lanes(lanes, lanes, lanes), code

    return Words(load, store, spread, add_product)
