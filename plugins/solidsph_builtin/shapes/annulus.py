"""Annulus: a ring in the plane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from reprlib import repr as short
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import length_field, point_field, refusal
from solidsph_builtin.shapes._sampling import ON_LINE, Piece, circle, joined


@attrs.frozen
class Annulus(Shape):
    """The points of the plane from `inner_radius` to `outer_radius` away from `centre`.

    Faces: inner, outer.

    Raises:
        SceneError: a radius is not a positive finite number, the inner one is not the smaller
            one, or the centre is not two numbers.
    """

    inner_radius: float = length_field()  # [m]
    outer_radius: float = length_field()  # [m]
    centre: tuple[float, ...] = point_field(2)  # [m]

    dimension: ClassVar[int] = 2
    example: ClassVar[Mapping[str, Any]] = {"inner_radius": 0.2, "outer_radius": 0.5}

    def __attrs_post_init__(self) -> None:
        if self.inner_radius >= self.outer_radius:
            expected = f"less than outer_radius = {self.outer_radius!r} m"
            raise refusal(self, "inner_radius", expected, short(self.inner_radius))

    def bounds(self) -> tuple[Array, Array]:
        centre = np.array(self.centre)
        return centre - self.outer_radius, centre + self.outer_radius

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        radius = np.hypot(*(points - np.array(self.centre)).T)
        distance: Array = np.maximum(self.inner_radius - radius, radius - self.outer_radius)
        return distance

    def surface(self, spacing: float) -> Surface:
        """Samples whose arc lengths add up to the exact circumferences."""
        pieces: list[Piece] = []
        for name, radius, sign in (
            ("inner", self.inner_radius, -1.0),
            ("outer", self.outer_radius, 1.0),
        ):
            normals, arcs = circle(radius, spacing, ON_LINE)
            points = np.array(self.centre) + radius * normals
            pieces.append((name, points, sign * normals * arcs[:, np.newaxis]))
        return joined(pieces)

    def volume(self) -> float:
        return math.pi * (self.outer_radius**2 - self.inner_radius**2)
