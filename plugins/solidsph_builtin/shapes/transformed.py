"""Transformed: a shape of another size, turned and moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._composite import as_shape, check_shape
from solidsph_builtin.shapes._placement import (
    Placement,
    check_placement,
    rotation_field,
    scale_field,
    translation_field,
)


@final
@attrs.frozen
class Transformed(Shape):
    """The shape `of`, times `scale` about the origin, then turned about it, then moved.

    In the plane `rotate` is one angle, counterclockwise; in space there are three, about the axes
    x, y and z, which stay where they are, one after the other. Faces keep their names.

    Raises:
        SceneError: a value is not a shape, or angles and way do not fit its dimension.
    """

    of: Shape = attrs.field(converter=as_shape, validator=check_shape, metadata={"part": "shapes"})
    scale: float = scale_field()
    rotate: tuple[float, ...] = rotation_field()  # [degrees]
    translate: tuple[float, ...] = translation_field()  # [m]

    example: ClassVar[Mapping[str, Any]] = {
        "of": {"type": "box", "lengths": [1.2, 0.8]},
        "rotate": 30.0,
    }

    def __attrs_post_init__(self) -> None:
        check_placement(self, self.dimension, self.rotate, self.translate)

    @property
    def dimension(self) -> int:
        return self.of.dimension

    @property
    def convex(self) -> bool:
        """As of the shape."""
        return self.of.convex

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the turned box around the shape."""
        lower, upper = self.of.bounds()
        grid = np.meshgrid(*np.stack([lower, upper], axis=1), indexing="ij")
        corners = self._placement.placed(np.stack(grid, axis=-1).reshape(-1, self.dimension))
        return corners.min(axis=0), corners.max(axis=0)

    def signed_distance(self, points: Array) -> Array:
        """As exact as that of the shape."""
        return self.scale * self.of.signed_distance(self._placement.drawn(points))

    def surface(self, spacing: float) -> Surface:
        """The samples of the shape, in their new places."""
        surface, placement = self.of.surface(spacing / self.scale), self._placement
        areas = self.scale ** (self.dimension - 1) * placement.turned(surface.area_vectors)
        return Surface(placement.placed(surface.points), areas, surface.faces)

    def volume(self) -> float | None:
        known = self.of.volume()
        return None if known is None else self.scale**self.dimension * known

    def moments(self, about: Array) -> Moments | None:
        placement = self._placement
        known = self.of.moments(placement.drawn(about[None])[0])
        if known is None:
            return None
        R, factor = placement.rotation, self.scale**self.dimension
        return Moments(
            factor * known.volume,
            factor * self.scale * R @ known.first,
            factor * self.scale**2 * R @ known.second @ R.T,
        )

    def distance_within(self, points: Array, reach: float) -> Array:
        return self.scale * self.of.distance_within(
            self._placement.drawn(points), reach / self.scale
        )

    def nearest(self, points: Array) -> Array | None:
        found = self.of.nearest(self._placement.drawn(points))
        return None if found is None else self._placement.placed(found)

    @property
    def _placement(self) -> Placement:
        return Placement.of(self.dimension, self.scale, self.rotate, self.translate)
