"""Ball: a full sphere in space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_number, as_numbers, check_coordinates, check_length
from solidsph_builtin.shapes._sampling import joined, sphere


@attrs.frozen
class Ball(Shape):
    """The points of space within `radius` of `centre`. Face: surface.

    Raises:
        SceneError: the radius is not a positive finite number, or the centre not three numbers.
    """

    radius: float = attrs.field(converter=as_number, validator=check_length)  # [m]
    centre: tuple[float, ...] = attrs.field(  # [m]
        default=(0.0, 0.0, 0.0), converter=as_numbers, validator=check_coordinates(3)
    )

    example: ClassVar[Mapping[str, Any]] = {"radius": 0.5}

    @property
    def dimension(self) -> int:
        """3."""
        return 3

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
        offset = points - np.array(self.centre)
        distance: Array = np.sqrt(np.einsum("ni,ni->n", offset, offset)) - self.radius
        return distance

    def surface(self, spacing: float) -> Surface:
        """As in the interface; the areas add up to the exact area."""
        normals, areas = sphere(self.radius, spacing)
        points = np.array(self.centre) + self.radius * normals
        return joined([("surface", points, normals * areas[:, np.newaxis])])

    def volume(self) -> float:
        """Volume [m^3]."""
        return 4.0 / 3.0 * math.pi * self.radius**3
