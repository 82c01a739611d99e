"""Disc: a full circle in the plane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import length_field, point_field
from solidsph_builtin.shapes._sampling import ON_LINE, circle, joined


@attrs.frozen
class Disc(Shape):
    """The points of the plane within `radius` of `centre`. Face: rim.

    Raises:
        SceneError: the radius is not a positive finite number, or the centre not two numbers.
    """

    radius: float = length_field()  # [m]
    centre: tuple[float, ...] = point_field(2)  # [m]

    dimension: ClassVar[int] = 2
    convex: ClassVar[bool] = True
    example: ClassVar[Mapping[str, Any]] = {"radius": 0.5}

    def bounds(self) -> tuple[Array, Array]:
        centre = np.array(self.centre)
        return centre - self.radius, centre + self.radius

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        distance: Array = np.hypot(*(points - np.array(self.centre)).T) - self.radius
        return distance

    def surface(self, spacing: float) -> Surface:
        """Samples whose arc lengths add up to the exact circumference."""
        normals, arcs = circle(self.radius, spacing, ON_LINE)
        points = np.array(self.centre) + self.radius * normals
        return joined([("rim", points, normals * arcs[:, np.newaxis])])

    def volume(self) -> float:
        return math.pi * self.radius**2
