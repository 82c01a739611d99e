"""Box: a bar, a rectangle or a cuboid aligned with the axes."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from reprlib import repr as short
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_numbers, check_coordinates, check_lengths, refusal
from solidsph_builtin.shapes._sampling import ON_LINE, ON_SURFACE, Piece, joined, midpoints

_FACES = (("left", "right"), ("bottom", "top"), ("front", "back"))


def _zeros(box: Any) -> tuple[float, ...]:
    # Called before the lengths are checked: they may still be anything.
    return (0.0,) * (len(box.lengths) if isinstance(box.lengths, tuple) else 0)


@attrs.frozen
class Box(Shape):
    """The points from `origin` to `origin + lengths`, in as many dimensions as there are lengths.

    Faces: left, right (across x), bottom, top (y), front, back (z).

    Raises:
        SceneError: a parameter is not a list of 1, 2 or 3 finite numbers, a length is not
            positive, or the origin has another number of coordinates than there are lengths.
    """

    lengths: tuple[float, ...] = attrs.field(  # [m]
        converter=as_numbers, validator=check_lengths(1, 2, 3)
    )
    origin: tuple[float, ...] = attrs.field(  # lower corner [m]
        default=attrs.Factory(_zeros, takes_self=True),
        converter=as_numbers,
        validator=check_coordinates(1, 2, 3),
    )

    convex: ClassVar[bool] = True
    example: ClassVar[Mapping[str, Any]] = {"lengths": [1.2, 0.8]}

    def __attrs_post_init__(self) -> None:
        if len(self.origin) != len(self.lengths):
            expected = f"a list of {len(self.lengths)} coordinates, one for each length"
            raise refusal(self, "origin", expected, short(self.origin))

    @property
    def dimension(self) -> int:
        return len(self.lengths)

    def bounds(self) -> tuple[Array, Array]:
        lower = np.array(self.origin)
        return lower, lower + np.array(self.lengths)

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        # Column by column: NumPy is slow at reductions over rows this short.
        beyond = [
            np.abs(points[:, axis] - (start + 0.5 * length)) - 0.5 * length
            for axis, (start, length) in enumerate(zip(self.origin, self.lengths, strict=True))
        ]
        deepest = functools.reduce(np.maximum, beyond)
        nearest = functools.reduce(np.hypot, (np.maximum(gap, 0.0) for gap in beyond))
        distance: Array = np.where(deepest > 0.0, nearest, deepest)
        return distance

    def surface(self, spacing: float) -> Surface:
        per_cell = ON_SURFACE if self.dimension == 3 else ON_LINE
        along = [
            start + midpoints(length, spacing, per_cell)
            for start, length in zip(self.origin, self.lengths, strict=True)
        ]
        lower, upper = self.bounds()
        pieces: list[Piece] = []
        for axis, names in enumerate(_FACES[: self.dimension]):
            for name, end, outward in zip(names, (lower[axis], upper[axis]), (-1, 1), strict=True):
                grids = [*along[:axis], np.array([end]), *along[axis + 1 :]]
                points = np.stack([g.ravel() for g in np.meshgrid(*grids, indexing="ij")], axis=1)
                area = math.prod(self.lengths[:axis] + self.lengths[axis + 1 :]) / len(points)
                area_vectors = np.zeros_like(points)
                area_vectors[:, axis] = outward * area
                pieces.append((name, points, area_vectors))
        return joined(pieces)

    def volume(self) -> float:
        return math.prod(self.lengths)
