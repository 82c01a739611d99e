"""Union: several shapes as one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.shapes._composite import as_parts, check_parts, corners, remaining

# Up to so many parts, the distance of every point to each is computed.
_FEW_PARTS = 16

# Points that are compared with the boxes of all parts at once.
_TOGETHER = 128


@attrs.frozen
class Union(Shape):
    """The points in any of the shapes `of`, which may overlap, touch or lie apart.

    Faces keep the names that they have in their shape; equal names become one face. Shapes in a
    table have their names in those of their faces: `of = {foot = {type = "box", ...}}` has the
    face foot.left.

    Raises:
        SceneError: there is no shape, a value is not a shape, or their dimensions differ.
    """

    of: tuple[Shape, ...] = attrs.field(
        converter=as_parts, validator=check_parts, metadata={"part": "shapes"}
    )

    example: ClassVar[Mapping[str, Any]] = {
        "of": [
            {"type": "box", "lengths": [1.2, 0.8]},
            {"type": "disc", "radius": 0.3, "centre": [1.2, 0.8]},
        ]
    }

    @property
    def dimension(self) -> int:
        return self.of[0].dimension

    def bounds(self) -> tuple[Array, Array]:
        lower, upper = corners(self.of)
        return lower.min(axis=0), upper.max(axis=0)

    def signed_distance(self, points: Array) -> Array:
        """The distance; inside, a lower bound of it, 0 on a seam of two parts."""
        distance = np.full(len(points), np.inf)
        for rows, parts in self._near(points):
            for part in parts:
                distance[rows] = np.minimum(
                    distance[rows], self.of[part].signed_distance(points[rows])
                )
        return distance

    def _near(self, points: Array) -> Iterator[tuple[Indices | slice, Sequence[int]]]:
        """Groups of the points, and the parts that may be nearest to one of them."""
        if len(self.of) <= _FEW_PARTS or not len(points):
            yield slice(None), range(len(self.of))
            return
        lower, upper = corners(self.of)
        order = cKDTree(points, leafsize=_TOGETHER).indices  # near points follow each other
        for rows in np.array_split(order, 1 + len(order) // _TOGETHER):
            low, high = points[rows].min(axis=0), points[rows].max(axis=0)
            # Least and largest distance between the box of the points and that of a part.
            least = np.linalg.norm(np.maximum(0.0, np.maximum(lower - high, low - upper)), axis=1)
            most = np.linalg.norm(np.maximum(upper - low, high - lower), axis=1)
            yield rows, np.flatnonzero(least <= most.min()).tolist()

    def surface(self, spacing: float) -> Surface:
        """Samples of a surface that is closed up to a sample where two boundaries cross."""
        surfaces = [part.surface(spacing) for part in self.of]
        return remaining(self, self.of, surfaces, spacing)

    def volume(self) -> None:
        """None: how much the shapes overlap is not known."""
