"""Fields of parts that take numbers from a scene."""

from __future__ import annotations

from math import inf
from numbers import Real
from typing import Any

import attrs

from solidsph.errors import SceneError


def as_number(value: Any, field: attrs.Attribute[Any]) -> float:
    """`value` as a float; raises ValueError if it is not a number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError(f"{field.name} must be a number, got {value!r}")
    try:
        return float(value)
    except OverflowError:
        return inf


def number(**options: Any) -> Any:
    """An attrs field that holds a float and refuses text, true and false."""
    return attrs.field(converter=attrs.Converter(as_number, takes_field=True), **options)


def optional_number(**options: Any) -> Any:
    """An attrs field that holds a float or None, the default."""

    def converted(value: Any, field: attrs.Attribute[Any]) -> float | None:
        return None if value is None else as_number(value, field)

    return attrs.field(
        default=None, converter=attrs.Converter(converted, takes_field=True), **options
    )


def formula(**options: Any) -> Any:
    """An attrs field that holds a formula or a table of formulas, checked with the whole scene."""
    return attrs.field(metadata={"formula": True}, **options)


def is_formula(field: attrs.Attribute[Any]) -> bool:
    """Whether a field was declared by `formula`."""
    return bool(field.metadata.get("formula"))


def check_positive(part: str, name: str, value: float, unit: str) -> None:
    """Raise SceneError unless `value` is positive and neither infinite nor absurdly large."""
    if not 1e-100 < value < 1e100:
        raise SceneError(
            f"{part}: {name} must be positive and finite, got {value}; give it in {unit}"
        )
