"""The content of functions, which tells compiled code of one from that of another."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types
from numba.extending import intrinsic

from solidsph.engines.compiled.content import UnknownContentError, content


def function(text: str, **held: Any) -> Any:
    """The function `f` of a text, in a module of its own that holds these."""
    space = {"np": np, "math": math, **held}
    exec(text, space)
    return space["f"]


def of(text: str, **held: Any) -> str:
    return content(function(text, **held))


def multiplied(by: Any) -> Any:
    def f(x: Any) -> Any:
        return by * x

    return f


F = "def f(x): return a*x"


def test_equal_functions_have_equal_content() -> None:
    assert of(F, a=2.0) == of(F, a=2.0)
    assert content(multiplied(2.0)) == content(multiplied(2.0))
    assert of("def f(x):\n\n    return a*x", a=2.0) == of(F, a=2.0)  # lines do not count


@pytest.mark.parametrize(
    ("text", "held"),
    [
        (F, {"a": 2}),  # an integer
        (F, {"a": 3.0}),
        (F, {"a": -0.0}),
        (F, {"a": math.nextafter(2.0, 3.0)}),
        (F, {"a": np.float32(2.0)}),
        (F, {"a": np.array([2.0])}),
        (F, {"a": (2.0,)}),
        ("def f(x): return x*a", {"a": 2.0}),
        ("def f(x): return a/x", {"a": 2.0}),
        ("def f(x, y=1): return a*x", {"a": 2.0}),
        ("def f(x, y=2): return a*x", {"a": 2.0}),
        ("def f(x): return np.sin(x)", {}),
        ("def f(x): return np.cos(x)", {}),
        ("def f(x): return math.sin(x)", {}),
        ("def f(x): return g(x)", {"g": multiplied(2.0)}),
        ("def f(x): return g(x)", {"g": multiplied(3.0)}),
        ("def f(x): return g(x)", {"g": numba.njit(multiplied(2.0))}),
        ("def f(x): return g(x)", {"g": numba.njit(fastmath=True)(multiplied(2.0))}),
        ("def f(x):\n  def g(y): return y + 1\n  return g(x)", {}),
        ("def f(x):\n  def g(y): return y + 2\n  return g(x)", {}),
    ],
)
def test_each_of_these_differs_from_all_others(text: str, held: Any) -> None:
    mine = of(text, **held)
    others = [
        of(other, **values)
        for mark in test_each_of_these_differs_from_all_others.pytestmark
        for other, values in mark.args[1]
        if (other, values) is not (text, held) and (other, repr(values)) != (text, repr(held))
    ]
    assert len(others) >= 19
    assert mine not in others
    assert mine != of(F, a=2.0)


@given(st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_numbers_by_their_bits(a: float, b: float) -> None:
    same = np.float64(a).tobytes() == np.float64(b).tobytes()
    assert (content(multiplied(a)) == content(multiplied(b))) == same


def test_helpers_of_helpers_and_modules_count() -> None:
    def module(factor: float) -> ModuleType:
        found = ModuleType("helpers")
        found.scale = multiplied(factor)  # type: ignore[attr-defined]
        found.unused = object()  # type: ignore[attr-defined]
        return found

    text = "def f(x): return helpers.scale(x)"
    assert of(text, helpers=module(2.0)) == of(text, helpers=module(2.0))
    assert of(text, helpers=module(2.0)) != of(text, helpers=module(3.0))
    deep = "def f(x): return g(x)"
    two, three = (function(deep, g=function(F, a=factor)) for factor in (2.0, 3.0))
    assert of(deep, g=two) != of(deep, g=three)


def test_code_of_the_compiler_s_own_kind_counts() -> None:
    def one(value: float) -> Any:
        @intrinsic
        def constant(typing: Any) -> Any:
            def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
                return context.get_constant(types.float64, value)

            return types.float64(), code

        return constant

    text = "def f(x): return x + g()"
    assert of(text, g=one(2.0)) == of(text, g=one(2.0))
    assert of(text, g=one(2.0)) != of(text, g=one(3.0))


class Two(NamedTuple):
    a: float
    b: float


def pair(*names: str) -> Any:
    return NamedTuple("Two", [(name, float) for name in names])  # type: ignore[misc]


def test_types_of_arguments() -> None:
    real, whole = types.float64, types.int64
    several = [
        types.UniTuple(real, 2),
        types.Tuple((real, whole)),
        types.NamedUniTuple(real, 2, Two),
        types.NamedUniTuple(real, 2, pair("b", "a")),
        types.Array(real, 2, "C"),
        types.Array(real, 2, "A"),
        types.Array(real, 2, "C", readonly=True),
        types.Array(real, 1, "C"),
        types.Array(types.float32, 2, "C"),
    ]
    assert len({content(one) for one in several}) == len(several)
    assert content(types.UniTuple(real, 2)) == content(types.UniTuple(real, 2))


def with_empty_cell() -> Callable[[], Any]:
    def f() -> Any:
        return later

    if f is None:
        later = 1.0
    return f


def calling_itself(n: int) -> int:
    return n and calling_itself(n - 1)


@pytest.mark.parametrize(
    "value",
    [
        multiplied(object()),
        multiplied(np.array([object()])),
        multiplied({1, 2}.__contains__),
        multiplied(type("Own", (), {})),
        with_empty_cell(),
        calling_itself,
        types.Dispatcher(numba.njit(multiplied(2.0))),
    ],
)
def test_what_is_not_known_has_no_content(value: Any) -> None:
    with pytest.raises(UnknownContentError):
        content(value)


def test_another_process_finds_the_same_content() -> None:
    """Whatever it seeds its hashes with."""
    program = """
from solidsph.engines.compiled.content import content
from solidsph.engines.compiled.fixed.block_law import block_law
from solidsph.engines.compiled.fixed.block_sweeps import force_sweep
from solidsph.engines.compiled.history_law import without_history
from solidsph.engines.compiled.pointwise import compiled_flux
from solidsph_builtin.gradients._passes import passes
from solidsph_builtin.formulations.total_lagrangian import TotalLagrangian
from solidsph_builtin.materials.neo_hookean import NeoHookean

formulation = TotalLagrangian()
law = compiled_flux(formulation, NeoHookean(1e6, 0.3, 1000.0), 2)
apply = block_law(2, "float64", without_history(law), 0, 2)
print(content(force_sweep(2, "float64", apply), frozenset("abc"), passes(2, 2, False).product))
"""
    found = {
        subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            check=True,
            env={"PYTHONHASHSEED": seed, "PATH": "", "SOLIDSPH_CACHE": "/nowhere"},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(found) == 1
    assert len(found.pop().strip()) == 64
