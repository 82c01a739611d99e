"""Fields of shapes: converters that never fail, and validators that explain."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from numbers import Real
from reprlib import repr as short
from typing import Any, TypeAlias

import attrs
from attrs import Attribute

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape

Validator: TypeAlias = Callable[[Any, "Attribute[Any]", Any], None]


def refusal(shape: Shape, parameter: str, expected: str, got: str) -> SceneError:
    """The error to raise for an invalid `parameter` of a `shape`."""
    name = type(shape).__name__.lower()
    return SceneError(f"shape {name!r}: {parameter} must be {expected}, got {got}")


def as_number(value: Any) -> Any:
    """A real number as a float; anything else unchanged, for the validator to refuse."""
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return value


def as_numbers(value: Any) -> Any:
    """Several numbers as a tuple of floats; anything else unchanged."""
    return as_tuple(value, as_number)


def as_points(value: Any) -> Any:
    """Several points as a tuple of tuples of floats; anything else unchanged."""
    return as_tuple(value, as_numbers)


def as_tuple(value: Any, convert: Callable[[Any], Any]) -> Any:
    """A list, tuple or array with each item converted; text or a single value unchanged."""
    if isinstance(value, Iterable) and not isinstance(value, str | bytes | dict):
        return tuple(convert(item) for item in value)
    return value


def is_number(value: object) -> bool:
    """Whether `value` is a finite number."""
    return isinstance(value, float) and math.isfinite(value)


def check_length(shape: Shape, field: Attribute[Any], value: object) -> None:
    """Refuse a value that is not a positive finite length."""
    if not (isinstance(value, float) and is_number(value) and value > 0.0):
        raise refusal(shape, field.name, "a positive finite length in m", short(value))


def check_coordinate(shape: Shape, field: Attribute[Any], value: object) -> None:
    """Refuse a value that is not a finite coordinate."""
    if not is_number(value):
        raise refusal(shape, field.name, "a finite coordinate in m", short(value))


def check_lengths(*dimensions: int) -> Validator:
    """A validator that requires one positive length for each of so many dimensions."""

    def check(shape: Shape, field: Attribute[Any], value: object) -> None:
        if not (_is_vector(value, dimensions) and min(value) > 0.0):  # type: ignore[call-overload]
            expected = f"a list of {_either(dimensions)} positive finite lengths in m"
            raise refusal(shape, field.name, expected, short(value))

    return check


def check_coordinates(*dimensions: int) -> Validator:
    """A validator that requires one finite coordinate for each of so many dimensions."""

    def check(shape: Shape, field: Attribute[Any], value: object) -> None:
        if not _is_vector(value, dimensions):
            expected = f"a list of {_either(dimensions)} finite coordinates in m"
            raise refusal(shape, field.name, expected, short(value))

    return check


def length_field() -> Any:
    """An attrs field that holds a positive length."""
    return attrs.field(converter=as_number, validator=check_length)


def point_field(dimension: int) -> Any:
    """An attrs field that holds a point, by default the origin."""
    return attrs.field(
        default=(0.0,) * dimension, converter=as_numbers, validator=check_coordinates(dimension)
    )


def _is_vector(value: object, dimensions: tuple[int, ...]) -> bool:
    return isinstance(value, tuple) and len(value) in dimensions and all(map(is_number, value))


def _either(dimensions: tuple[int, ...]) -> str:
    *most, last = map(str, dimensions)
    return f"{', '.join(most)} or {last}" if most else last
