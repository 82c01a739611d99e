"""Named: a shape whose faces carry its name."""

from __future__ import annotations

import re
from collections.abc import Mapping
from reprlib import repr as short
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import refusal


def _check_name(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not (isinstance(value, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", value)):
        raise refusal(
            shape,
            field.name,
            "a word of letters, digits, '-' and '_', a letter first",
            short(value),
        )


def _check_shape(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not isinstance(value, Shape):
        raise refusal(shape, field.name, "a shape", short(value))


@final
@attrs.frozen
class Named(Shape):
    """The shape `of`, whose faces are called NAME.FACE: rim of the disc hole is hole.rim.

    Where several shapes are asked for, a table of them by name makes such shapes.

    Raises:
        SceneError: the name is no word, or the value no shape.
    """

    name: str = attrs.field(validator=_check_name)
    of: Shape = attrs.field(validator=_check_shape, metadata={"part": "shapes"})

    example: ClassVar[Mapping[str, Any]] = {
        "name": "plate",
        "of": {"type": "box", "lengths": [1.2, 0.8]},
    }

    @property
    def dimension(self) -> int:
        return self.of.dimension

    @property
    def convex(self) -> bool:
        """As of the shape."""
        return self.of.convex

    def bounds(self) -> tuple[Array, Array]:
        return self.of.bounds()

    def signed_distance(self, points: Array) -> Array:
        """That of the shape."""
        return self.of.signed_distance(points)

    def surface(self, spacing: float) -> Surface:
        """That of the shape, with longer names."""
        surface = self.of.surface(spacing)
        longer = {face: f"{self.name}.{face.replace('.', '-')}" for face in set(surface.faces)}
        return attrs.evolve(surface, faces=tuple(map(longer.__getitem__, surface.faces)))

    def volume(self) -> float | None:
        return self.of.volume()

    def moments(self, about: Array) -> Moments | None:
        return self.of.moments(about)

    def distance_within(self, points: Array, reach: float) -> Array:
        return self.of.distance_within(points, reach)

    def nearest(self, points: Array) -> Array | None:
        return self.of.nearest(points)
