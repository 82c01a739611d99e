"""Interval: a straight bar in one dimension."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_number, check_coordinate, length_field


@attrs.frozen
class Interval(Shape):
    """The points `origin` <= X <= `origin + length`. Faces: left, right.

    Raises:
        SceneError: a parameter is not a finite number, or the length is not positive.
    """

    length: float = length_field()  # [m]
    origin: float = attrs.field(  # left end [m]
        default=0.0, converter=as_number, validator=check_coordinate
    )

    dimension: ClassVar[int] = 1
    convex: ClassVar[bool] = True
    example: ClassVar[Mapping[str, Any]] = {"length": 1.3}

    def bounds(self) -> tuple[Array, Array]:
        return np.array([self.origin]), np.array([self.origin + self.length])

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        centre = self.origin + 0.5 * self.length
        distance: Array = np.abs(points[:, 0] - centre) - 0.5 * self.length
        return distance

    def surface(self, spacing: float) -> Surface:
        """The two ends; their area is 1."""
        ends = np.array([[self.origin], [self.origin + self.length]])
        return Surface(ends, np.array([[-1.0], [1.0]]), ("left", "right"))

    def volume(self) -> float:
        return self.length
