"""Arithmetic of lanes, by which a formula of numbers is one of lanes too.

What is missing here does not compile for lanes.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic, overload

from solidsph.engines.compiled.fixed.lanes import Lanes, spread

# Sums of products may be rounded once; nothing else is reordered.
_ONCE = ("contract",)


def _define_two(function: Any, build: Callable[..., Any]) -> None:
    """Define `function` of lanes, or of lanes and a number, by `build` (builder, a, b)."""

    @intrinsic
    def combined(typing: Any, a: Any, b: Any) -> Any:
        lanes = a if isinstance(a, Lanes) else b

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            def laid(kind: Any, value: Any) -> Any:
                if isinstance(kind, Lanes):
                    return value
                number = context.cast(builder, value, kind, lanes.element)
                return spread(context, builder, number, lanes)

            return build(builder, *map(laid, signature.args, args))

        return lanes(a, b), code

    @overload(function, strict=False)
    def defined(a: Any, b: Any) -> Any:
        if isinstance(a, Lanes) and isinstance(b, Lanes | types.Number):
            return lambda a, b: combined(a, b)
        if isinstance(a, types.Number) and isinstance(b, Lanes):
            return lambda a, b: combined(a, b)
        return None


def _define_one(function: Any, name: str) -> None:
    """Define `function` of lanes by LLVM's function of this name."""

    @intrinsic
    def found(typing: Any, a: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            vector = args[0].type
            named = f"llvm.{name}.v{vector.count}{vector.element.intrinsic_name}"
            kind = ir.FunctionType(vector, [vector])
            return builder.call(get_or_insert_function(builder.module, kind, named), args)

        return a(a), code

    @overload(function, strict=False)
    def defined(a: Any) -> Any:
        return (lambda a: found(a)) if isinstance(a, Lanes) else None


def _extreme(sign: str) -> Callable[..., Any]:
    """The lesser or the greater of two; undefined if one is, as in NumPy."""

    def build(builder: Any, a: Any, b: Any) -> Any:
        ahead = builder.fcmp_ordered(sign, a, b)
        undefined = builder.fcmp_unordered("uno", a, a)
        return builder.select(builder.or_(ahead, undefined), a, b)

    return build


_define_two(operator.add, lambda builder, a, b: builder.fadd(a, b, flags=_ONCE))
_define_two(operator.sub, lambda builder, a, b: builder.fsub(a, b, flags=_ONCE))
_define_two(operator.mul, lambda builder, a, b: builder.fmul(a, b, flags=_ONCE))
_define_two(operator.truediv, lambda builder, a, b: builder.fdiv(a, b))
_define_two(np.minimum, _extreme("<"))
_define_two(np.maximum, _extreme(">"))
_define_one(np.sqrt, "sqrt")
_define_one(np.abs, "fabs")


@intrinsic
def chosen(typing: Any, lanes: Any, bits: Any) -> Any:
    """Lanes with a bit set, and zeros; a number itself."""
    if isinstance(lanes, types.Number):
        return lanes(lanes, bits), lambda context, builder, signature, args: args[0]

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value, number = args
        width = value.type.count
        few = builder.trunc(number, ir.IntType(width))
        wanted = builder.bitcast(few, ir.VectorType(ir.IntType(1), width))
        return builder.select(wanted, value, ir.Constant(value.type, None))

    return lanes(lanes, bits), code


@overload(operator.pow, strict=False, prefer_literal=True)
def _power(a: Any, b: Any) -> Any:
    """Squares, which formulas have more often than other powers."""
    if isinstance(a, Lanes) and isinstance(b, types.IntegerLiteral) and b.literal_value == 2:
        return lambda a, b: a * a
    return None
