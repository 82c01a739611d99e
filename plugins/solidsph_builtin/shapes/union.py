"""Union: several shapes as one."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.interfaces.shape import Shape, Surface
from solidsph_builtin.shapes._composite import as_parts, check_parts, remaining


@attrs.frozen
class Union(Shape):
    """The points in any of the shapes `of`, which may overlap, touch or lie apart.

    Faces keep the names that they have in their shape; equal names become one face.

    Raises:
        SceneError: there is no shape, one is not a shape, or their dimensions differ.
    """

    of: tuple[Shape, ...] = attrs.field(
        converter=as_parts, validator=check_parts, metadata={"part": "shapes"}
    )

    @property
    def dimension(self) -> int:
        """That of the shapes."""
        return self.of[0].dimension

    def bounds(self) -> tuple[Array, Array]:
        """As in the interface."""
        lower, upper = zip(*(part.bounds() for part in self.of), strict=True)
        return np.min(lower, axis=0), np.max(upper, axis=0)

    def signed_distance(self, points: Array) -> Array:
        """As in the interface; inside, no more than the distance, and 0 on a seam of two parts."""
        distance = self.of[0].signed_distance(points)
        for part in self.of[1:]:
            distance = np.minimum(distance, part.signed_distance(points))
        return distance

    def surface(self, spacing: float) -> Surface:
        """As in the interface, closed but for a sample wherever two boundaries cross."""
        surfaces = [part.surface(spacing) for part in self.of]
        return remaining(self, self.of, surfaces, spacing)

    def volume(self) -> None:
        """None: how much the shapes overlap is not known."""
