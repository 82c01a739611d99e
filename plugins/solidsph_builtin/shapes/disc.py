"""Disc: a full circle in the plane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_number, as_numbers, check_coordinates, check_length
from solidsph_builtin.shapes._sampling import ON_LINE, circle, joined


@attrs.frozen
class Disc(Shape):
    """The points of the plane within `radius` of `centre`. Face: rim.

    Raises:
        SceneError: the radius is not a positive finite number, or the centre not two numbers.
    """

    radius: float = attrs.field(converter=as_number, validator=check_length)  # [m]
    centre: tuple[float, ...] = attrs.field(  # [m]
        default=(0.0, 0.0), converter=as_numbers, validator=check_coordinates(2)
    )

    example: ClassVar[Mapping[str, Any]] = {"radius": 0.5}

    @property
    def dimension(self) -> int:
        """2."""
        return 2

    @property
    def convex(self) -> bool:
        """True."""
        return True

    def bounds(self) -> tuple[Array, Array]:
        """As in the interface."""
        centre = np.array(self.centre)
        return centre - self.radius, centre + self.radius

    def signed_distance(self, points: Array) -> Array:
        """As in the interface; exact everywhere."""
        distance: Array = np.hypot(*(points - np.array(self.centre)).T) - self.radius
        return distance

    def surface(self, spacing: float) -> Surface:
        """As in the interface; the arc lengths add up to the exact circumference."""
        normals, arcs = circle(self.radius, spacing, ON_LINE)
        points = np.array(self.centre) + self.radius * normals
        return joined([("rim", points, normals * arcs[:, np.newaxis])])

    def volume(self) -> float:
        """Area [m^2]."""
        return math.pi * self.radius**2
