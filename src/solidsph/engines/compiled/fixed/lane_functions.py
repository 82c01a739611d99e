"""Exponentials, logarithms and powers of lanes.

Arguments are reduced to a short interval and the series of the function is summed there, so that
all lanes take the same way. Results are within a few units of the last digit, as those of the
functions of numbers are, infinite and undefined ones included.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from math import factorial, log, sqrt
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic, overload

from solidsph.engines.compiled.fixed.lanes import Lanes, laid

# ln 2 in two parts: the first has zeros at its end, so that products with exponents are exact.
_LN2 = float.fromhex("0x1.62e42fefa0000p-1")
_REST = float.fromhex("0x1.cf79abc9e3b39p-40")

# Added and taken away, it rounds to an integer, which is then in the last bits of the sum.
_ROUNDER = 1.5 * 2.0**52

# exp is 0 below the first and infinite above the second.
_LEAST, _MOST = -746.0, 710.0

# Terms of series: of exp for |r| < ln(2)/2, of (artanh(s)/s - 1)/s^2 for |s| < 0.172. What follows
# them is below 1e-17.
_EXP = [1.0 / factorial(k) for k in range(2, 15)]
_ARTANH = [1.0 / (2 * k + 3) for k in range(11)]

_SMALLEST_NORMAL, _SCALE = 2.0**-1022, 54


class _Builder:
    """Operations on lanes of doubles and on integers of their size."""

    def __init__(self, builder: Any, count: int) -> None:
        self.builder = builder
        self.numbers = ir.VectorType(ir.DoubleType(), count)
        self.integers = ir.VectorType(ir.IntType(64), count)

    def number(self, value: float) -> Any:
        return ir.Constant(self.numbers, [value] * self.numbers.count)

    def integer(self, value: int) -> Any:
        return ir.Constant(self.integers, [value] * self.integers.count)

    def add(self, a: Any, b: Any) -> Any:
        return self.builder.fadd(a, b, flags=("contract",))

    def sub(self, a: Any, b: Any) -> Any:
        return self.builder.fsub(a, b, flags=("contract",))

    def mul(self, a: Any, b: Any) -> Any:
        return self.builder.fmul(a, b, flags=("contract",))

    def less(self, a: Any, b: Any) -> Any:
        return self.builder.fcmp_ordered("<", a, b)

    def select(self, condition: Any, a: Any, b: Any) -> Any:
        return self.builder.select(condition, a, b)

    def bits(self, a: Any) -> Any:
        return self.builder.bitcast(a, self.integers)

    def of_bits(self, a: Any) -> Any:
        return self.builder.bitcast(a, self.numbers)

    def call(self, name: str, a: Any) -> Any:
        kind = ir.FunctionType(self.numbers, [self.numbers])
        named = f"llvm.{name}.v{self.numbers.count}f64"
        return self.builder.call(get_or_insert_function(self.builder.module, kind, named), [a])

    def series(self, x: Any, terms: Sequence[float]) -> Any:
        """terms[0] + terms[1] x + ..., even and odd powers side by side."""
        square = self.mul(x, x)
        even, odd = self._horner(square, terms[::2]), self._horner(square, terms[1::2])
        return self.add(even, self.mul(x, odd))

    def _horner(self, x: Any, terms: Sequence[float]) -> Any:
        total = self.number(terms[-1])
        for term in terms[-2::-1]:
            total = self.add(self.mul(total, x), self.number(term))
        return total

    def power_of_two(self, n: Any) -> Any:
        """2^n of integers -1022 to 1023."""
        return self.of_bits(
            self.builder.shl(self.builder.add(n, self.integer(1023)), self.integer(52))
        )

    def reduced(self, x: Any) -> tuple[Any, Any]:
        """Integers n and the series of exp(r) - 1, with x = n ln 2 + r within the bounds of exp."""
        x = self.select(self.less(x, self.number(_LEAST)), self.number(_LEAST), x)
        x = self.select(self.less(self.number(_MOST), x), self.number(_MOST), x)
        shifted = self.add(self.mul(x, self.number(1.0 / log(2.0))), self.number(_ROUNDER))
        n = self.builder.sub(self.bits(shifted), self.bits(self.number(_ROUNDER)))
        whole = self.sub(shifted, self.number(_ROUNDER))
        r = self.sub(x, self.mul(whole, self.number(_LN2)))
        r = self.sub(r, self.mul(whole, self.number(_REST)))
        return n, self.add(r, self.mul(self.mul(r, r), self.series(r, _EXP)))

    def exp(self, x: Any) -> Any:
        n, risen = self.reduced(x)
        # In two steps, because 2^n may be beyond what a double can hold where the result is not.
        half = self.builder.ashr(n, self.integer(1))
        first, second = self.power_of_two(half), self.power_of_two(self.builder.sub(n, half))
        return self.mul(self.mul(self.add(risen, self.number(1.0)), first), second)

    def expm1(self, x: Any) -> Any:
        n, risen = self.reduced(x)
        # Beyond 2^54 the one is rounding; there the power would not do.
        few = self.builder.icmp_signed("<", n, self.integer(55))
        some = self.builder.icmp_signed(">", n, self.integer(-1000))
        power = self.power_of_two(self.select(self.builder.and_(few, some), n, self.integer(-1000)))
        small = self.add(self.mul(risen, power), self.sub(power, self.number(1.0)))
        return self.select(few, small, self.exp(x))

    def log(self, x: Any) -> Any:
        tiny = self.less(x, self.number(_SMALLEST_NORMAL))
        scaled = self.select(tiny, self.mul(x, self.number(2.0**_SCALE)), x)
        bits, mantissa = self.bits(scaled), self.integer((1 << 52) - 1)
        # m from 1 to 2, then from sqrt(1/2) to sqrt(2).
        m = self.builder.or_(self.builder.and_(bits, mantissa), self.bits(self.number(1.0)))
        m, n = self.of_bits(m), self.builder.lshr(bits, self.integer(52))
        large = self.less(self.number(sqrt(2.0)), m)
        m = self.select(large, self.mul(m, self.number(0.5)), m)
        n = self.builder.sub(n, self.select(large, self.integer(1022), self.integer(1023)))
        n = self.builder.sub(n, self.select(tiny, self.integer(_SCALE), self.integer(0)))
        whole = self.builder.sitofp(n, self.numbers)
        f = self.sub(m, self.number(1.0))
        s = self.builder.fdiv(f, self.add(f, self.number(2.0)))
        square = self.mul(s, s)
        # 2 artanh(s) = f - s (f - 2 s^2 (1/3 + s^2/5 + ...)): f is exact.
        beyond = self.mul(self.mul(self.number(2.0), square), self.series(square, _ARTANH))
        of_m = self.sub(f, self.mul(s, self.sub(f, beyond)))
        found = self.add(
            self.mul(whole, self.number(_LN2)), self.add(of_m, self.mul(whole, self.number(_REST)))
        )
        infinite = self.number(np.inf)
        found = self.select(self.less(x, infinite), found, x)  # infinite or undefined
        zero = self.number(0.0)
        found = self.select(self.builder.fcmp_ordered("==", x, zero), self.number(-np.inf), found)
        return self.select(self.less(x, zero), self.number(np.nan), found)

    def power(self, a: Any, b: Any) -> Any:
        size = self.exp(self.mul(b, self.log(self.call("fabs", a))))
        # Of negative numbers there are whole powers only.
        half = self.mul(self.number(0.5), b)
        is_whole = self.builder.fcmp_ordered("==", self.call("floor", b), b)
        is_even = self.builder.fcmp_ordered("==", self.call("floor", half), half)
        signed = self.select(is_even, size, self.builder.fneg(size))
        of_negative = self.select(is_whole, signed, self.number(np.nan))
        found = self.select(self.less(a, self.number(0.0)), of_negative, size)
        one = self.builder.fcmp_ordered("==", b, self.number(0.0))
        return self.select(one, self.number(1.0), found)


def _define(function: Any, build: Callable[..., Any]) -> None:
    """Define `function` of lanes of doubles by `build` (builder, a)."""

    @intrinsic
    def found(typing: Any, a: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return build(_Builder(builder, a.count), *args)

        return a(a), code

    @overload(function, strict=False)
    def defined(a: Any) -> Any:
        if isinstance(a, Lanes) and a.element == types.float64:
            return lambda a: found(a)
        return None


_define(np.exp, _Builder.exp)
_define(np.expm1, _Builder.expm1)
_define(np.log, _Builder.log)


@intrinsic
def _to_power(typing: Any, a: Any, b: Any) -> Any:
    lanes = Lanes(types.float64, (a if isinstance(a, Lanes) else b).count)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        both = zip(signature.args, args, strict=True)
        base, exponent = (laid(context, builder, *one, lanes) for one in both)
        return _Builder(builder, lanes.count).power(base, exponent)

    return lanes(a, b), code


@overload(operator.pow, strict=False, prefer_literal=True)
def _power(a: Any, b: Any) -> Any:
    """Squares and cubes, which formulas have more often than other powers, by products."""
    if not isinstance(a, Lanes):
        return (lambda a, b: _to_power(a, b)) if isinstance(b, Lanes) else None
    if isinstance(b, types.IntegerLiteral) and b.literal_value == 2:
        return lambda a, b: a * a
    if isinstance(b, types.IntegerLiteral) and b.literal_value == 3:
        return lambda a, b: a * a * a
    return (lambda a, b: _to_power(a, b)) if isinstance(b, Lanes | types.Number) else None
