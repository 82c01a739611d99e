"""Points as JSON, infinite errors included."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import attrs

from solidsph.studies.point import Point
from solidsph.studies.task import plain


def to_json(point: Point) -> dict[str, Any]:
    """`point` as an object of JSON. Its settings are written as people read them."""
    table = {field.name: getattr(point, field.name) for field in attrs.fields(Point)}
    return {
        **table,
        "settings": plain(point.settings),
        "error": _number(point.error),
        "value": None if point.value is None else _number(point.value),
        "reference": None if point.reference is None else _number(point.reference),
        "spacing": _number(point.spacing),
        "seconds": [_number(one) for one in point.seconds],
    }


def from_json(table: Mapping[str, Any], settings: Mapping[str, Any]) -> Point:
    """The point that `to_json` wrote, with the settings that it was measured with.

    Raises:
        KeyError, TypeError, ValueError: the table is no point.
    """
    return Point(
        settings=dict(settings),
        error=float(table["error"]),
        outcome=str(table["outcome"]),
        quantity=str(table["quantity"]),
        value=_optional(table["value"]),
        reference=_optional(table["reference"]),
        spacing=float(table["spacing"]),
        particles=int(table["particles"]),
        steps=int(table["steps"]),
        pair_evaluations=int(table["pair_evaluations"]),
        bytes_touched=int(table["bytes_touched"]),
        seconds=tuple(float(one) for one in table["seconds"]),
        peak_memory=int(table["peak_memory"]),
    )


def _optional(value: Any) -> float | None:
    return None if value is None else float(value)


def _number(value: float) -> float | str:
    return float(value) if isfinite(value) else str(float(value))  # JSON has no infinity
