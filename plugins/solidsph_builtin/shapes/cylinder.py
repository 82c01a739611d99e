"""Cylinder: a round bar along one of the axes."""

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
from solidsph_builtin.shapes._sampling import ON_SURFACE, Piece, circle, disc, joined, midpoints


def _axis(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not (isinstance(value, str) and value in ("x", "y", "z")):
        raise refusal(shape, field.name, "'x', 'y' or 'z'", short(value))


@attrs.frozen
class Cylinder(Shape):
    """The points within `radius` of an axis that runs over `length` from `base_centre`.

    Faces: side; base, the flat face around `base_centre`; end, the flat face opposite.

    Raises:
        SceneError: the radius or the length is not a positive finite number, the centre is not
            three numbers, or the axis is not a letter x, y or z.
    """

    radius: float = length_field()  # [m]
    length: float = length_field()  # [m]
    base_centre: tuple[float, ...] = point_field(3)  # [m]
    axis: str = attrs.field(default="z", validator=_axis)  # from the base to the end

    dimension: ClassVar[int] = 3
    convex: ClassVar[bool] = True
    example: ClassVar[Mapping[str, Any]] = {"radius": 0.5, "length": 1.3}

    def bounds(self) -> tuple[Array, Array]:
        across = np.full(3, self.radius)
        across["xyz".index(self.axis)] = 0.0
        lower, upper = np.array(self.base_centre) - across, np.array(self.base_centre) + across
        upper["xyz".index(self.axis)] += self.length
        return lower, upper

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        # Rolled so that the axis comes first: (axial, across, across).
        offset = np.roll(points - np.array(self.base_centre), -"xyz".index(self.axis), axis=1)
        beyond_ends = np.abs(offset[:, 0] - 0.5 * self.length) - 0.5 * self.length
        beyond_side = np.hypot(offset[:, 1], offset[:, 2]) - self.radius
        deepest = np.maximum(beyond_ends, beyond_side)
        outside = np.hypot(np.maximum(beyond_ends, 0.0), np.maximum(beyond_side, 0.0))
        distance: Array = np.where(deepest > 0.0, outside, deepest)
        return distance

    def surface(self, spacing: float) -> Surface:
        """Samples whose areas add up to the exact area of each face."""
        along = midpoints(self.length, spacing, ON_SURFACE)
        normals, arcs = circle(self.radius, spacing, ON_SURFACE)
        flat, areas = disc(self.radius, spacing)
        # Axis first, as above: every direction at every height, then the two flat faces.
        up, around = np.tile(along, len(arcs)), np.repeat(normals, along.size, axis=0)
        areas_around = np.repeat(arcs * (self.length / along.size), along.size)[:, np.newaxis]
        side_points = np.column_stack([up, self.radius * around])
        side_areas = np.column_stack([np.zeros(up.size), areas_around * around])
        zero = np.zeros(len(flat))
        base_points = np.column_stack([zero, flat])
        end_points = np.column_stack([zero + self.length, flat])
        flat_areas = np.column_stack([areas, zero, zero])
        pieces: list[Piece] = [
            ("side", side_points, side_areas),
            ("base", base_points, -flat_areas),
            ("end", end_points, flat_areas),
        ]
        centre, turn = np.array(self.base_centre), "xyz".index(self.axis)
        return joined(
            [
                (name, centre + np.roll(points, turn, axis=1), np.roll(area, turn, axis=1))
                for name, points, area in pieces
            ]
        )

    def volume(self) -> float:
        return math.pi * self.radius**2 * self.length
