"""A shape whose surface is sampled once at every spacing."""

from __future__ import annotations

from typing import final

import attrs

from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array


def sampled_once(shape: Shape) -> Shape:
    """`shape`, which keeps its samples for as long as particles are made of it."""
    return shape if isinstance(shape, _SampledOnce) else _SampledOnce(shape)


@final
@attrs.frozen(eq=False)
class _SampledOnce(Shape):
    of: Shape
    _known: dict[float, Surface] = attrs.field(factory=dict, init=False)  # by spacing [m]

    @property
    def dimension(self) -> int:
        return self.of.dimension

    def bounds(self) -> tuple[Array, Array]:
        return self.of.bounds()

    def signed_distance(self, points: Array) -> Array:
        return self.of.signed_distance(points)

    @property
    def convex(self) -> bool:
        return self.of.convex

    def surface(self, spacing: float) -> Surface:
        if spacing not in self._known:
            self._known[spacing] = self.of.surface(spacing)
        return self._known[spacing]

    def volume(self) -> float | None:
        return self.of.volume()

    def moments(self, about: Array) -> Moments | None:
        return self.of.moments(about)

    def nearest(self, points: Array) -> Array | None:
        return self.of.nearest(points)

    def distance_within(self, points: Array, reach: float) -> Array:
        return self.of.distance_within(points, reach)
