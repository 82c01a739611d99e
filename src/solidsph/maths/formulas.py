"""Formulas in scene files: arithmetic on named variables, and nothing else.

A formula is parsed by Python's own parser and evaluated node by node from a short list of
permitted nodes, so a scene file can never run code.

A comparison is true or false as an operand of `and`, `or`, `not` and `where`. In arithmetic and in
other functions it is the number 1.0 or 0.0, so that "(t > 1) + (t > 2)" counts. A number without
any comparison is not a condition: "(t > 1) and 5" would be 1, and is refused.
"""

from __future__ import annotations

import ast
import difflib
import operator
import warnings
from collections.abc import Callable, Collection, Mapping
from functools import cache
from math import isfinite
from reprlib import repr as short
from typing import Any

import attrs
import numpy as np

from solidsph.errors import SceneError

MAX_LENGTH = 1000  # characters
MAX_DEPTH = 50  # of nesting; evaluation recurses, and formulas written by hand are far below

_CONSTANTS = {"pi": np.pi, "e": np.e}

_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "tan": (1, np.tan),
    "asin": (1, np.arcsin),
    "acos": (1, np.arccos),
    "atan2": (2, np.arctan2),
    "sinh": (1, np.sinh),
    "cosh": (1, np.cosh),
    "tanh": (1, np.tanh),
    "exp": (1, np.exp),
    "log": (1, np.log),
    "sqrt": (1, np.sqrt),
    "abs": (1, np.abs),
    "hypot": (2, np.hypot),
    "min": (2, np.minimum),
    "max": (2, np.maximum),
    "clip": (3, np.clip),
    "where": (3, np.where),
}

_ARITHMETIC: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_LOGIC: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Not: np.logical_not,
    ast.And: np.logical_and,
    ast.Or: np.logical_or,
}
_OPERATORS = _ARITHMETIC | _LOGIC


@attrs.frozen
class Expression:
    """A checked formula of the named variables."""

    text: str
    variables: tuple[str, ...]
    _tree: ast.expr = attrs.field(eq=False, repr=False)

    @classmethod
    def parse(
        cls, text: str, variables: Collection[str], conditions: Collection[str] = ()
    ) -> Expression:
        """Check `text` as a formula of `variables`.

        Args:
            text: the formula.
            variables: the names that it may use.
            conditions: the variables that are true or false; the others are numbers.

        Raises:
            SceneError: it is not a formula, or uses an unknown name.
        """
        if len(text) > MAX_LENGTH:
            raise SceneError(f"formula of {len(text)} characters; at most {MAX_LENGTH} are allowed")
        try:
            tree = _read(text)
            _check(tree, text, tuple(variables))
            if _depth(tree) > MAX_DEPTH:
                raise ValueError(f"nested more than {MAX_DEPTH} deep")
            _check_conditions(tree, text, frozenset(conditions))
        except (SyntaxError, ValueError, RecursionError, MemoryError, Warning) as cause:
            why = cause.msg if isinstance(cause, SyntaxError) else cause
            raise SceneError(
                f"formula {text!r} cannot be read ({why}); write arithmetic such as "
                "'0.2*X' or 'X < 0.1 and Y > 0'"
            ) from None
        return cls(text, tuple(variables), tree)

    def __call__(self, values: Mapping[str, Any]) -> Any:
        """The value of the formula; `values` holds a number or an array for each variable."""
        # A formula may divide by zero or leave a function's domain; the caller checks the value.
        with np.errstate(all="ignore"):
            return _evaluate(self._tree, {**_CONSTANTS, **values})


@cache
def names_in(text: str) -> frozenset[str]:
    """Names used in a valid formula."""
    return frozenset(node.id for node in ast.walk(_read(text)) if isinstance(node, ast.Name))


def _read(text: str) -> ast.expr:
    with warnings.catch_warnings():
        # Python only warns of syntax that it will refuse one day, such as "1or X".
        warnings.simplefilter("error")
        return ast.parse(text.strip(), mode="eval").body


def _depth(node: ast.AST) -> int:
    return 1 + max((_depth(child) for child in ast.iter_child_nodes(node)), default=0)


def _check(node: ast.AST, text: str, variables: tuple[str, ...]) -> None:
    def refuse(what: str) -> SceneError:
        return SceneError(
            f"formula {text!r}: {what} is not allowed; use numbers, {', '.join(variables)}, "
            f"+ - * / ** %, comparisons, and/or/not, and {', '.join(_FUNCTIONS)}"
        )

    parts: list[ast.expr] = []
    match node:
        case ast.Constant(value=bool()):
            raise refuse(repr(node.value))
        case ast.Constant(value=int() | float() as number):
            if not _is_double(number):
                written = ast.get_source_segment(text.strip(), node)
                raise SceneError(
                    f"formula {short(text)}: the number {short(written)} is too large; at most "
                    "about 1.8e308 can be computed with"
                )
        case ast.Name(id=name):
            known = (*variables, *_CONSTANTS)
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                hint = f"; did you mean {near[0]!r}?" if near else f"; known: {', '.join(known)}"
                raise SceneError(f"formula {text!r}: unknown name {name!r}{hint}")
        case ast.Attribute() if ast.unparse(node) in variables:  # a tag of one body: "two.left"
            pass
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            parts = [left, right]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            parts = [operand]
        case ast.BoolOp(values=parts):
            pass
        case ast.Compare(left=left, ops=ops, comparators=others) if all(
            type(op) in _OPERATORS for op in ops
        ):
            parts = [left, *others]
        case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]) if name in _FUNCTIONS:
            wanted = _FUNCTIONS[name][0]
            if len(parts) != wanted:
                raise SceneError(
                    f"formula {text!r}: {name} takes {wanted} arguments, got {len(parts)}"
                )
        case _:
            raise refuse(repr(ast.unparse(node)))
    for part in parts:
        _check(part, text, variables)


def _check_conditions(tree: ast.AST, text: str, conditions: frozenset[str]) -> None:
    """Raise SceneError if a number is used as a condition."""
    for node in ast.walk(tree):
        wanted: list[ast.expr] = []
        match node:
            case ast.BoolOp(values=wanted):
                word = "and" if isinstance(node.op, ast.And) else "or"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                wanted, word = [operand], "not"
            case ast.Call(func=ast.Name(id="where"), args=[first, *_]):
                wanted, word = [first], "where"
        for part in wanted:
            if not any(_is_condition(inner, conditions) for inner in ast.walk(part)):
                raise SceneError(
                    f"formula {text!r}: {ast.unparse(part)!r} is a number, and {word!r} takes "
                    "conditions such as 'X > 0.1'; compare it, or multiply it by a comparison: "
                    "'5*(t > 0.1)'"
                )


def _is_condition(node: ast.AST, conditions: frozenset[str]) -> bool:
    match node:
        case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
            return True
        case ast.Name(id=name):
            return name in conditions
        case ast.Attribute():
            return ast.unparse(node) in conditions
    return False


def _is_double(number: float) -> bool:
    try:
        return isfinite(float(number))
    except OverflowError:  # an integer of hundreds of digits
        return False


def _evaluate(node: ast.AST, values: Mapping[str, Any]) -> Any:
    def number(part: ast.AST) -> Any:
        """The value of a part as a double or an array of doubles: true is 1, false is 0."""
        return np.asarray(_evaluate(part, values), dtype=np.float64)

    match node:
        case ast.Constant(value=constant):
            # Floats overflow to infinity where integers would grow without end.
            return np.float64(constant)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return values[name]
        case ast.Attribute():
            return values[ast.unparse(node)]
        case ast.BinOp(left=left, op=op, right=right):
            return _ARITHMETIC[type(op)](number(left), number(right))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return np.logical_not(_evaluate(operand, values))
        case ast.UnaryOp(op=op, operand=operand):
            return _ARITHMETIC[type(op)](number(operand))
        case ast.BoolOp(op=op, values=parts):
            result = _evaluate(parts[0], values)
            for part in parts[1:]:
                result = _LOGIC[type(op)](result, _evaluate(part, values))
            return result
        case ast.Compare(left=left, ops=ops, comparators=others):
            terms = [number(part) for part in (left, *others)]
            result = np.True_
            for comparison, a, b in zip(ops, terms[:-1], terms[1:], strict=True):
                result = np.logical_and(result, _ARITHMETIC[type(comparison)](a, b))
            return result
        case ast.Call(func=ast.Name(id="where"), args=args):
            return np.where(*(_evaluate(part, values) for part in args))
        case ast.Call(func=ast.Name(id=name), args=args):
            return _FUNCTIONS[name][1](*(number(part) for part in args))
    raise AssertionError(f"unchecked node {ast.dump(node)}")
