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

from solidsph.engines.compiled.fixed.lanes import Lanes, laid
from solidsph.engines.compiled.pointwise import number

# Sums of products may be rounded once; nothing else is reordered.
_ONCE = ("contract",)


def _define_two(function: Any, build: Callable[..., Any], found: Any = types.float64) -> None:
    """Define `function` of lanes, or of lanes and a number, by `build` (builder, a, b) for two
    lanes of doubles; it gives lanes of the type `found`."""

    @intrinsic
    def combined(typing: Any, a: Any, b: Any) -> Any:
        lanes = Lanes(types.float64, (a if isinstance(a, Lanes) else b).count)

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            both = zip(signature.args, args, strict=True)
            return build(builder, *(laid(context, builder, *one, lanes) for one in both))

        return Lanes(found, lanes.count)(a, b), code

    @overload(function, strict=False)
    def defined(a: Any, b: Any) -> Any:
        if isinstance(a, Lanes) and isinstance(b, Lanes | types.Number | types.Boolean):
            return lambda a, b: combined(a, b)
        if isinstance(a, types.Number | types.Boolean) and isinstance(b, Lanes):
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


def _compared(sign: str) -> Callable[..., Any]:
    """Whether two compare so; false if one is undefined, but for "!="."""
    if sign == "!=":
        return lambda builder, a, b: builder.fcmp_unordered(sign, a, b)
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


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
for _function, _sign in (
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _define_two(_function, _compared(_sign), types.boolean)
_define_one(np.sqrt, "sqrt")
_define_one(np.abs, "fabs")


@intrinsic
def _one_or_other(typing: Any, condition: Any, a: Any, b: Any) -> Any:
    lanes = Lanes(types.float64, condition.count)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        which, *both = args
        kinds = signature.args[1:]
        values = (laid(context, builder, *one, lanes) for one in zip(kinds, both, strict=True))
        return builder.select(which, *values)

    return lanes(condition, a, b), code


@overload(np.where, strict=False)
def _where(condition: Any, x: Any, y: Any) -> Any:
    if isinstance(condition, Lanes) and condition.element == types.boolean:
        return lambda condition, x, y: _one_or_other(condition, x, y)
    return None


@intrinsic
def _negative(typing: Any, a: Any) -> Any:
    return a(a), lambda context, builder, signature, args: builder.fneg(args[0])


@overload(operator.neg, strict=False)
def _neg(a: Any) -> Any:
    return (lambda a: _negative(a)) if isinstance(a, Lanes) else None


@overload(number, strict=False)
def _itself(component: Any) -> Any:
    return (lambda component: component) if isinstance(component, Lanes) else None


@intrinsic
def _in_any(typing: Any, a: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        bits = ir.IntType(a.count)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), ir.Constant(bits, 0))

    return types.boolean(a), code


@overload(np.any, strict=False)
def _any(a: Any) -> Any:
    """Whether a condition holds in any lane."""
    if isinstance(a, Lanes) and a.element == types.boolean:
        return lambda a: _in_any(a)
    return None


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
