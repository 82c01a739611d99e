"""A shape that keeps its promises, and others that each break one of them."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph import (
    Shape,
)
from solidsph.interfaces.shape import Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes.box import Box


@attrs.frozen
class GoodShape(Shape):
    """The unit square."""

    @property
    def square(self) -> Shape:
        return Box([1.0, 1.0])

    @property
    def dimension(self) -> int:
        return 2

    def bounds(self) -> tuple[Array, Array]:
        return self.square.bounds()

    def signed_distance(self, points: Array) -> Array:
        return self.square.signed_distance(points)

    def surface(self, spacing: float) -> Surface:
        return self.square.surface(spacing)

    def volume(self) -> float:
        return 1.0


class DistanceAsColumn(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return super().signed_distance(points)[:, None]


class BoundsTooSmall(GoodShape):
    def bounds(self) -> tuple[Array, Array]:
        lower, upper = super().bounds()
        return lower, 0.9 * upper


class OpenBelow(GoodShape):
    def surface(self, spacing: float) -> Surface:
        whole = super().surface(spacing)
        kept = np.array(whole.faces) != "bottom"
        faces = tuple(face for face in whole.faces if face != "bottom")
        return Surface(whole.points[kept], whole.area_vectors[kept], faces)


class LargerThanItIs(GoodShape):
    def volume(self) -> float:
        return 1.01


class DistanceFromInside(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return super().signed_distance(points) + 1e-3


class DistanceInOtherUnits(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return 1e3 * super().signed_distance(points)


class DeeperThanItIs(GoodShape):
    """Right near the boundary only: a point in the middle seems to be far from it."""

    def signed_distance(self, points: Array) -> Array:
        distance = super().signed_distance(points)
        return np.where(distance < -0.1, 4.0 * distance, distance)


class NotConvex(GoodShape):
    """A square without its middle."""

    @property
    def convex(self) -> bool:
        return True

    def signed_distance(self, points: Array) -> Array:
        hole = Box([0.4, 0.4], [0.3, 0.3]).signed_distance(points)
        return np.maximum(super().signed_distance(points), -hole)


class InsideOut(GoodShape):
    def signed_distance(self, points: Array) -> Array:
        return -super().signed_distance(points)


class SampledCoarsely(GoodShape):
    def surface(self, spacing: float) -> Surface:
        return super().surface(0.1)


class FacesBySpacing(GoodShape):
    def surface(self, spacing: float) -> Surface:
        whole = super().surface(spacing)
        return attrs.evolve(whole, faces=tuple(f"{face}-{spacing:g}" for face in whole.faces))


SHAPES = [
    (DistanceAsColumn, {"arrays"}),
    (BoundsTooSmall, {"bounds"}),
    (OpenBelow, {"closed boundary"}),
    (LargerThanItIs, {"volume"}),
    (DistanceFromInside, {"on boundary"}),
    (DistanceInOtherUnits, {"distance near boundary"}),
    (DeeperThanItIs, {"distance bound"}),
    (NotConvex, {"convex lines"}),
    (InsideOut, {"sign", "distance near boundary"}),
    (SampledCoarsely, {"sampling"}),
    (FacesBySpacing, {"named faces"}),
]
