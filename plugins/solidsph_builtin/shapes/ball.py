"""Ball: a full sphere in space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import length_field, point_field
from solidsph_builtin.shapes._sampling import joined, sphere


@attrs.frozen
class Ball(Shape):
    """The points of space within `radius` of `centre`. Face: surface.

    Raises:
        SceneError: the radius is not a positive finite number, or the centre not three numbers.
    """

    radius: float = length_field()  # [m]
    centre: tuple[float, ...] = point_field(3)  # [m]

    dimension: ClassVar[int] = 3
    convex: ClassVar[bool] = True
    example: ClassVar[Mapping[str, Any]] = {"radius": 0.5}

    def bounds(self) -> tuple[Array, Array]:
        centre = np.array(self.centre)
        return centre - self.radius, centre + self.radius

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        offset = points - np.array(self.centre)
        distance: Array = np.sqrt(np.einsum("ni,ni->n", offset, offset)) - self.radius
        return distance

    def surface(self, spacing: float) -> Surface:
        """Samples whose areas add up to the exact area."""
        normals, areas = sphere(self.radius, spacing)
        points = np.array(self.centre) + self.radius * normals
        return joined([("surface", points, normals * areas[:, np.newaxis])])

    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * self.radius**3
