"""Placement: size, turn and place of something that was drawn elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from reprlib import repr as short
from typing import Any

import attrs
import numpy as np
from attrs import Attribute

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_number, as_numbers, is_number, refusal

UNITS: Mapping[str, float] = {
    "m": 1.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "in": 0.0254,
    "ft": 0.3048,
}
"""Length of each unit [m]."""


@attrs.frozen(eq=False)
class Placement:
    """x -> scale R x + offset, with a rotation R."""

    scale: float
    rotation: Array  # (d, d) [-]
    offset: Array  # (d,) [m]

    @classmethod
    def of(
        cls, dimension: int, scale: float, rotate: tuple[float, ...], translate: tuple[float, ...]
    ) -> Placement:
        """The placement by angles [degrees] and a way [m], each empty for none.

        In space the angles are about the axes x, y and z, which stay where they are, one after the
        other; in the plane there is one.
        """
        rotation = np.eye(dimension)
        for axis, angle in enumerate(rotate):
            first, second = ((1, 2), (2, 0), (0, 1))[axis] if dimension == 3 else (0, 1)
            turn = np.eye(dimension)
            c, s = _cos_sin(angle)
            turn[[first, second], [first, second]] = c
            turn[first, second], turn[second, first] = -s, s
            rotation = turn @ rotation
        return cls(scale, rotation, np.array(translate or (0.0,) * dimension))

    def placed(self, points: Array) -> Array:
        """Where `points` (n, d) come to lie, (n, d) [m]."""
        result: Array = self.scale * points @ self.rotation.T + self.offset
        return result

    def drawn(self, points: Array) -> Array:
        """Where placed `points` (n, d) [m] were drawn, (n, d)."""
        result: Array = (points - self.offset) @ self.rotation / self.scale
        return result

    def turned(self, vectors: Array) -> Array:
        """`vectors` (n, d) turned, not scaled, (n, d)."""
        result: Array = vectors @ self.rotation.T
        return result


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine, exact for right angles."""
    quarter = degrees / 90.0
    if quarter == round(quarter):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def unit_field() -> Any:
    """An attrs field that holds the name of a unit of length."""
    return attrs.field(default="m", validator=_check_unit)


def scale_field() -> Any:
    """An attrs field that holds a factor."""
    return attrs.field(default=1.0, converter=as_number, validator=_check_scale)


def rotation_field() -> Any:
    """An attrs field that holds one angle in the plane, three in space [degrees]."""
    return attrs.field(default=(), converter=_as_angles, validator=_check_numbers)


def translation_field() -> Any:
    """An attrs field that holds a way [m]."""
    return attrs.field(default=(), converter=as_numbers, validator=_check_numbers)


def check_placement(
    shape: Shape, dimension: int, rotate: tuple[float, ...], translate: tuple[float, ...]
) -> None:
    """Raise SceneError unless angles and way fit the dimension."""
    count = {1: 0, 2: 1, 3: 3}[dimension]
    if len(rotate) not in (0, count):
        angles = "1 angle" if count == 1 else f"{count} angles"
        expected = f"{angles} in degrees, as the shape is {dimension}D"
        raise refusal(shape, "rotate", expected, short(list(rotate)))
    if len(translate) not in (0, dimension):
        expected = f"{dimension} coordinates in m, as the shape is {dimension}D"
        raise refusal(shape, "translate", expected, short(list(translate)))


def _as_angles(value: Any) -> Any:
    number = as_number(value)
    return (number,) if isinstance(number, float) else as_numbers(value)


def _check_unit(shape: Shape, field: Attribute[Any], value: object) -> None:
    if not (isinstance(value, str) and value in UNITS):
        raise refusal(shape, field.name, f"one of {', '.join(UNITS)}", short(value))


def _check_scale(shape: Shape, field: Attribute[Any], value: object) -> None:
    if not (isinstance(value, float) and is_number(value) and value > 0.0):
        raise refusal(shape, field.name, "a positive finite number", short(value))


def _check_numbers(shape: Shape, field: Attribute[Any], value: object) -> None:
    if not (isinstance(value, tuple) and all(map(is_number, value))):
        raise refusal(shape, field.name, "finite numbers", short(value))
