"""Extruded: a plane shape drawn out into a body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_number, check_coordinate, length_field, refusal
from solidsph_builtin.shapes._composite import as_shape, check_shape
from solidsph_builtin.shapes._flat import flat
from solidsph_builtin.shapes._sampling import ON_LINE, ON_SURFACE, joined, midpoints


@final
@attrs.frozen
class Extruded(Shape):
    """The plane shape `of`, drawn along z from `base` to `base + length`.

    'transformed' turns it to other axes. Faces: those of the shape on the side, base and end.

    Raises:
        SceneError: the shape is not plane, or a number not finite, or the length not positive.
    """

    of: Shape = attrs.field(converter=as_shape, validator=check_shape, metadata={"part": "shapes"})
    length: float = length_field()  # [m]
    base: float = attrs.field(  # [m]
        default=0.0, converter=as_number, validator=check_coordinate
    )

    dimension: ClassVar[int] = 3
    example: ClassVar[Mapping[str, Any]] = {
        "of": {"type": "box", "lengths": [1.2, 0.8]},
        "length": 0.5,
    }

    def __attrs_post_init__(self) -> None:
        if self.of.dimension != 2:
            raise refusal(self, "of", "a plane shape", f"one in {self.of.dimension}D")

    @property
    def convex(self) -> bool:
        """As of the shape."""
        return self.of.convex

    def bounds(self) -> tuple[Array, Array]:
        lower, upper = self.of.bounds()
        return np.append(lower, self.base), np.append(upper, self.base + self.length)

    def signed_distance(self, points: Array) -> Array:
        """As exact as that of the plane shape."""
        aside = self.of.signed_distance(points[:, :2])
        along = np.abs(points[:, 2] - (self.base + 0.5 * self.length)) - 0.5 * self.length
        outside = np.hypot(np.maximum(aside, 0.0), np.maximum(along, 0.0))
        return np.minimum(np.maximum(aside, along), 0.0) + outside

    def surface(self, spacing: float) -> Surface:
        """Samples whose areas are exact on the ends, and on the side as exact as the outline's."""
        outline = self.of.surface(spacing * ON_LINE / ON_SURFACE)
        heights = midpoints(self.length, spacing, ON_SURFACE)
        names = np.array(outline.faces, dtype=object)
        side = np.column_stack(
            [
                np.repeat(outline.points, len(heights), axis=0),
                np.tile(self.base + heights, len(outline.points)),
            ]
        )
        areas = np.repeat(outline.area_vectors * (self.length / len(heights)), len(heights), axis=0)
        inner, sizes = flat(self.of, spacing)
        up = np.column_stack([np.zeros_like(inner), sizes])
        ends = joined(
            [
                ("base", np.column_stack([inner, np.full(len(inner), self.base)]), -up),
                ("end", np.column_stack([inner, np.full(len(inner), self.base + self.length)]), up),
            ]
        )
        return Surface(
            np.concatenate([side, ends.points]),
            np.concatenate([np.column_stack([areas, np.zeros(len(areas))]), ends.area_vectors]),
            (*np.repeat(names, len(heights)).tolist(), *ends.faces),
        )

    def volume(self) -> float | None:
        known = self.of.volume()
        return None if known is None else known * self.length

    def moments(self, about: Array) -> Moments | None:
        known = self.of.moments(about[:2])
        if known is None:
            return None
        low = self.base - about[2]
        high = low + self.length
        one, two, three = self.length, (high**2 - low**2) / 2.0, (high**3 - low**3) / 3.0
        second = np.zeros((3, 3))
        second[:2, :2] = one * known.second
        second[:2, 2] = second[2, :2] = two * known.first
        second[2, 2] = three * known.volume
        first = np.append(one * known.first, two * known.volume)
        return Moments(one * known.volume, first, second)

    def nearest(self, points: Array) -> Array | None:
        """On the side or on an end, whichever is nearer."""
        feet = self.of.nearest(points[:, :2])
        if feet is None:
            return None
        aside = self.of.signed_distance(points[:, :2])
        end = self.base + np.where(points[:, 2] > self.base + 0.5 * self.length, self.length, 0.0)
        within = np.clip(points[:, 2], self.base, self.base + self.length)
        onto_side = np.column_stack([feet, within])
        onto_end = np.column_stack([np.where(aside[:, None] <= 0.0, points[:, :2], feet), end])
        nearer = np.linalg.norm(onto_end - points, axis=1) < np.linalg.norm(
            onto_side - points, axis=1
        )
        return np.where(nearer[:, None], onto_end, onto_side)
