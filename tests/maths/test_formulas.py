"""Formulas of scene files: right values, and nothing but arithmetic."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.errors import SceneError
from solidsph.maths.formulas import MAX_LENGTH, Expression

X = np.linspace(-1.0, 2.0, 7)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.2*X", 0.2 * X),
        ("-X**2 + 3 % 2", -(X**2) + 1.0),
        ("sin(pi*X)*exp(-t)", np.sin(np.pi * X) * np.exp(-0.5)),
        ("min(X, 0.5) + max(t, 1)", np.minimum(X, 0.5) + 1.0),
        ("where(X < 0 or X > 1, 1, 2)", np.where((X < 0) | (X > 1), 1.0, 2.0)),
        ("0 <= X < 1", (X >= 0) & (X < 1)),
        ("not (X > 0 and X < 1)", ~((X > 0) & (X < 1))),
        ("hypot(X, 1) - clip(X, 0, 1)", np.hypot(X, 1.0) - np.clip(X, 0.0, 1.0)),
    ],
)
def test_value(text: str, expected: np.ndarray) -> None:
    value = Expression.parse(text, ("X", "t"))({"X": X, "t": 0.5})
    assert np.array_equal(value, expected)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "X.__class__",
        "(lambda: 1)()",
        "[x for x in (1, 2)]",
        "X[0]",
        "'text'",
        "open(X)",
        "sin(X, 1)",
        "sin(*X)",
        "f'{X}'",
        "X if X else 1",
        "X := 1",
        "True",
        "1j",
        "",
        "   ",
        "(" * 500,
        "-" * 900 + "1",
        "1 +",
        "X\0",
        "x" * (MAX_LENGTH + 1),
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(SceneError):
        Expression.parse(text, ("X", "t"))


def test_unknown_name_has_the_nearest_match() -> None:
    with pytest.raises(SceneError, match=r"unknown name 'tt'; did you mean 't'\?"):
        Expression.parse("2*tt", ("X", "t"))


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("(t > 1) and 5e3", "5000.0"),  # in Python 5e3; as a condition it would be 1
        ("X > 0 or 0.5", "0.5"),
        ("tip and X", "X"),
        ("tip and X - 0.5", "X - 0.5"),
        ("1e3*(not t)", "t"),
        ("where(X, 1, 2)", "X"),
        ("where(X > 0 and t, 1, 2)", "t"),
    ],
)
def test_a_number_is_no_condition(text: str, number: str) -> None:
    with pytest.raises(SceneError, match=re.escape(f"{number!r} is a number")):
        Expression.parse(text, ("X", "t", "tip"), ("tip",))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("tip and (X > 0)*(X < 1)", (X > 0) & (X < 1)),  # as NumPy's users write "and"
        ("where((X > 0) + (X > 1), 5, 0)", np.where(X > 0, 5.0, 0.0)),
        ("not max(tip, X > 0)", np.zeros(7, dtype=bool)),
        ("where(tip, X, 0)", X),
    ],
)
def test_what_counts_comparisons_may_be_a_condition(text: str, expected: np.ndarray) -> None:
    values = {"X": X, "t": 0.5, "tip": np.ones(7, dtype=bool)}
    assert np.array_equal(Expression.parse(text, tuple(values), ("tip",))(values), expected)


def test_powers_overflow_instead_of_growing_without_end() -> None:
    assert Expression.parse("9**9**9**9", ())({}) == np.inf


@given(st.text(max_size=60))
def test_no_text_gives_anything_but_a_scene_error(text: str) -> None:
    try:
        expression = Expression.parse(text, ("X", "Y", "Z", "t"))
    except SceneError:
        return
    expression({"X": X, "Y": X, "Z": X, "t": 0.0})
