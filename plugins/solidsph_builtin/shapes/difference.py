"""Difference: a shape with holes and cuts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import refusal
from solidsph_builtin.shapes._composite import (
    as_parts,
    as_shape,
    check_parts,
    check_shape,
    remaining,
)


@attrs.frozen
class Difference(Shape):
    """The points of the shape `of` that are in none of the shapes `minus`.

    A face of a removed shape keeps its name, unless `of` has a face of that name: a box out of a
    box leaves left and hole-left. Shapes in a table have their names in those of their faces:
    `minus = {hole = {type = "disc", ...}}` leaves hole.rim.

    Raises:
        SceneError: a value is not a shape, nothing is removed, or the dimensions differ.
    """

    of: Shape = attrs.field(converter=as_shape, validator=check_shape, metadata={"part": "shapes"})
    minus: tuple[Shape, ...] = attrs.field(
        converter=as_parts, validator=check_parts, metadata={"part": "shapes"}
    )

    example: ClassVar[Mapping[str, Any]] = {
        "of": {"type": "box", "lengths": [1.2, 0.8]},
        "minus": {"type": "disc", "radius": 0.22, "centre": [0.6, 0.4]},
    }

    def __attrs_post_init__(self) -> None:
        dimension = self.minus[0].dimension
        if dimension != self.of.dimension:
            expected = f"of dimension {self.of.dimension}, as the shape that it is taken from"
            raise refusal(self, "minus", expected, f"dimension {dimension}")

    @property
    def dimension(self) -> int:
        return self.of.dimension

    def bounds(self) -> tuple[Array, Array]:
        """The bounds of `of`, whatever is removed."""
        return self.of.bounds()

    def signed_distance(self, points: Array) -> Array:
        """The distance; outside, a lower bound of it."""
        distance = self.of.signed_distance(points)
        for part in self.minus:
            distance = np.maximum(distance, -part.signed_distance(points))
        return distance

    def surface(self, spacing: float) -> Surface:
        """Samples of a surface that is closed up to a sample where two boundaries cross."""
        outer = self.of.surface(spacing)
        taken = frozenset(outer.faces)
        surfaces = [outer, *(_inverted(part.surface(spacing), taken) for part in self.minus)]
        return remaining(self, (self.of, *self.minus), surfaces, spacing)

    def volume(self) -> None:
        """None: how much of the removed shapes lies inside is not known."""


def _inverted(surface: Surface, taken: frozenset[str]) -> Surface:
    """The boundary of a hole: normals point into it."""
    names = {face: f"hole-{face}" if face in taken else face for face in set(surface.faces)}
    faces = tuple(map(names.__getitem__, surface.faces))
    return attrs.evolve(surface, area_vectors=-surface.area_vectors, faces=faces)
