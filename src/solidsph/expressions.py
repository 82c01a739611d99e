"""Formulas in scene files: arithmetic on named variables, and nothing else.

A formula is parsed by Python's own parser and then evaluated node by node from a short list of
permitted ones, so a scene file can never run code.
"""

from __future__ import annotations

import ast
import difflib
import operator
from collections.abc import Callable, Collection, Mapping
from functools import cache
from typing import Any

import attrs
import numpy as np

from solidsph.errors import SceneError

MAX_LENGTH = 1000  # characters
MAX_DEPTH = 50  # of nesting; evaluation recurses, and no formula that a person writes comes near

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

_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: np.logical_not,
    ast.And: np.logical_and,
    ast.Or: np.logical_or,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


@attrs.frozen
class Expression:
    """A checked formula of the named variables."""

    text: str
    variables: tuple[str, ...]
    _tree: ast.expr = attrs.field(eq=False, repr=False)

    @classmethod
    def parse(cls, text: str, variables: Collection[str]) -> Expression:
        """Check `text` as a formula of `variables`.

        Raises:
            SceneError: it is no formula, or names something unknown.
        """
        if len(text) > MAX_LENGTH:
            raise SceneError(f"formula of {len(text)} characters; at most {MAX_LENGTH} are allowed")
        try:
            tree = ast.parse(text.strip(), mode="eval").body
            _check(tree, text, tuple(variables))
            if _depth(tree) > MAX_DEPTH:
                raise ValueError(f"nested more than {MAX_DEPTH} deep")
        except (SyntaxError, ValueError, RecursionError, MemoryError) as cause:
            raise SceneError(
                f"formula {text!r} cannot be read ({cause}); write arithmetic such as "
                "'0.2*X' or 'X < 0.1 and Y > 0'"
            ) from None
        return cls(text, tuple(variables), tree)

    def __call__(self, values: Mapping[str, Any]) -> Any:
        """The value of the formula, where `values` holds a number or an array by variable."""
        # A formula may divide by zero or leave a function's domain; whoever uses the value checks.
        with np.errstate(all="ignore"):
            return _evaluate(self._tree, {**_CONSTANTS, **values})


@cache
def names_in(text: str) -> frozenset[str]:
    """Names that a formula, which can be parsed, uses."""
    tree = ast.parse(text.strip(), mode="eval")
    return frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))


def _depth(node: ast.AST) -> int:
    return 1 + max((_depth(child) for child in ast.iter_child_nodes(node)), default=0)


def _check(node: ast.AST, text: str, variables: tuple[str, ...]) -> None:
    def refuse(what: str) -> SceneError:
        return SceneError(
            f"formula {text!r}: {what} is not allowed; use numbers, {', '.join(variables)}, "
            f"+ - * / ** %, comparisons, and/or/not, and {', '.join(_FUNCTIONS)}"
        )

    match node:
        case ast.Constant(value=bool()):
            raise refuse(repr(node.value))
        case ast.Constant(value=int() | float()):
            return
        case ast.Name(id=name):
            known = (*variables, *_CONSTANTS)
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                hint = f"; did you mean {near[0]!r}?" if near else f"; known: {', '.join(known)}"
                raise SceneError(f"formula {text!r}: unknown name {name!r}{hint}")
        case ast.Attribute() if ast.unparse(node) in variables:  # a tag of one body: "two.left"
            return
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            _check(left, text, variables)
            _check(right, text, variables)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            _check(operand, text, variables)
        case ast.BoolOp(values=parts):
            for part in parts:
                _check(part, text, variables)
        case ast.Compare(left=left, ops=ops, comparators=others) if all(
            type(op) in _OPERATORS for op in ops
        ):
            for part in (left, *others):
                _check(part, text, variables)
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS:
            wanted = _FUNCTIONS[name][0]
            if len(args) != wanted:
                raise SceneError(
                    f"formula {text!r}: {name} takes {wanted} arguments, got {len(args)}"
                )
            for part in args:
                _check(part, text, variables)
        case _:
            raise refuse(repr(ast.unparse(node)))


def _evaluate(node: ast.AST, values: Mapping[str, Any]) -> Any:
    match node:
        case ast.Constant(value=number):
            # Floats overflow to infinity where integers would grow without end.
            return np.float64(number)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return values[name]
        case ast.Attribute():
            return values[ast.unparse(node)]
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_evaluate(left, values), _evaluate(right, values))
        case ast.UnaryOp(op=op, operand=operand):
            return _OPERATORS[type(op)](_evaluate(operand, values))
        case ast.BoolOp(op=op, values=parts):
            result = _evaluate(parts[0], values)
            for part in parts[1:]:
                result = _OPERATORS[type(op)](result, _evaluate(part, values))
            return result
        case ast.Compare(left=left, ops=ops, comparators=others):
            terms = [_evaluate(part, values) for part in (left, *others)]
            result = True
            for comparison, a, b in zip(ops, terms[:-1], terms[1:], strict=True):
                result = np.logical_and(result, _OPERATORS[type(comparison)](a, b))
            return result
        case ast.Call(func=ast.Name(id=name), args=args):
            return _FUNCTIONS[name][1](*(_evaluate(part, values) for part in args))
    raise AssertionError(f"unchecked node {ast.dump(node)}")
