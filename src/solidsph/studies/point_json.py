"""Points as JSON objects, infinite errors included."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import attrs

from solidsph.studies.point import Point
from solidsph.studies.task import plain


def to_json(point: Point) -> dict[str, Any]:
    """`point` as an object of JSON; its settings are only for reading."""
    table = attrs.asdict(point, recurse=False)
    numbers = {name: _number(value) for name, value in table.items() if isinstance(value, float)}
    seconds = [_number(value) for value in point.seconds]
    return {**table, **numbers, "settings": plain(point.settings), "seconds": seconds}


def from_json(table: Mapping[str, Any], settings: Mapping[str, Any]) -> Point:
    """Point from the table of `to_json`, with the settings of its task.

    Raises:
        KeyError, TypeError, ValueError: the table is not that of a point.
    """
    values = {field.name: table[field.name] for field in attrs.fields(Point)}
    return Point(**{**values, "settings": dict(settings)})


def _number(value: float) -> float | str:
    return value if isfinite(value) else str(value)  # JSON has no infinity
