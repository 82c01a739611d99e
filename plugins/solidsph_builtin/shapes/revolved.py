"""Revolved: a plane shape turned around an axis into a body."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from reprlib import repr as short
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_number, is_number, refusal
from solidsph_builtin.shapes._composite import as_shape, check_shape
from solidsph_builtin.shapes._flat import flat
from solidsph_builtin.shapes._sampling import ON_LINE, ON_SURFACE, Piece, joined
from solidsph_builtin.shapes._straight import right_integral, straight_outline

# Samples along the longest side for the check that a shape is its own mirror image, and how far it
# may be from that, in sizes.
_ALONG, _MIRRORED = 100, 1e-9


def _check_angle(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not (isinstance(value, float) and is_number(value) and 0.0 < value <= 360.0):
        raise refusal(shape, field.name, "an angle above 0 and up to 360 degrees", short(value))


@final
@attrs.frozen(slots=False)
class Revolved(Shape):
    """The plane shape `of`, turned by `angle` around its axis x = 0.

    Its x becomes the distance from the axis z of the body, its y the place along that; it begins in
    the half plane y = 0, x > 0. The shape lies beside the axis, or is its own mirror image in it:
    a disc about the axis makes a ball, a box from -R to R a cylinder.

    Faces: those of the shape; with an angle below 360 degrees also start and end.

    Raises:
        SceneError: the shape is not plane, or crosses the axis without being its mirror image.
    """

    of: Shape = attrs.field(converter=as_shape, validator=check_shape, metadata={"part": "shapes"})
    angle: float = attrs.field(  # [degrees]
        default=360.0, converter=as_number, validator=_check_angle
    )

    dimension: ClassVar[int] = 3
    example: ClassVar[Mapping[str, Any]] = {
        "of": {"type": "disc", "radius": 0.3, "centre": [0.8, 0.0]},
        "angle": 120.0,
    }

    def __attrs_post_init__(self) -> None:
        if self.of.dimension != 2:
            raise refusal(self, "of", "a plane shape", f"one in {self.of.dimension}D")
        lower, upper = self.of.bounds()
        if upper[0] <= 0.0:
            raise refusal(self, "of", "at x > 0, the distance from the axis", f"x < {upper[0]:.4g}")
        size = float((upper - lower).max())
        if lower[0] > 0.0:
            return
        mirror = self.of.surface(size / _ALONG).points * (-1.0, 1.0)
        off = np.abs(self.of.signed_distance(mirror))
        if off.max() > _MIRRORED * size:
            place = ", ".join(f"{x:.4g}" for x in mirror[int(np.argmax(off))])
            raise refusal(
                self,
                "of",
                "beside the axis x = 0, or its own mirror image in it (draw it on both sides)",
                f"one whose mirror image is {off.max():.3g} m off it at ({place}) m",
            )

    @property
    def convex(self) -> bool:
        """True for a full turn of a convex shape across the axis."""
        across = self.of.convex and bool(self.of.bounds()[0][0] < 0.0)
        return across and (self._whole or self.angle <= 180.0)

    def bounds(self) -> tuple[Array, Array]:
        lower, upper = self.of.bounds()
        inner, outer = max(0.0, float(lower[0])), float(upper[0])
        ends = [0.0, self._turn]
        ends += [q * 0.5 * math.pi for q in range(5) if q * 0.5 * math.pi < self._turn]
        angles = np.array(ends)
        x = np.concatenate([r * np.cos(angles) for r in (inner, outer)])
        y = np.concatenate([r * np.sin(angles) for r in (inner, outer)])
        return (
            np.array([x.min(), y.min(), lower[1]]),
            np.array([x.max(), y.max(), upper[1]]),
        )

    def signed_distance(self, points: Array) -> Array:
        """As exact as that of the plane shape; with an angle a lower bound outside of corners."""
        radius = np.hypot(points[:, 0], points[:, 1])
        distance = self.of.signed_distance(np.column_stack([radius, points[:, 2]]))
        return distance if self._whole else np.maximum(distance, self._from_wedge(points))

    def _from_wedge(self, points: Array) -> Array:
        """Distance of the wedge between start and end, (n,) [m]; negative inside."""
        middle = 0.5 * self._turn
        c, s = math.cos(middle), math.sin(middle)
        along = c * points[:, 0] + s * points[:, 1]
        aside = np.abs(c * points[:, 1] - s * points[:, 0])
        # From the nearer of the two half planes, which begin at the axis.
        behind = aside * math.cos(middle) - along * math.sin(middle)
        beyond = aside * math.sin(middle) + along * math.cos(middle) <= 0.0
        return np.where(beyond, np.copysign(np.hypot(along, aside), behind), behind)

    def surface(self, spacing: float) -> Surface:
        """Rings of samples along the outline, and grids on start and end."""
        outline = self.of.surface(spacing * ON_LINE / ON_SURFACE)
        beside = outline.points[:, 0] > 0.0
        points, areas = outline.points[beside], outline.area_vectors[beside]
        names = np.array(outline.faces, dtype=object)[beside]
        # A multiple of 8, as in all circles (`_sampling.angles`).
        rounds = self._turn * points[:, 0] * ON_SURFACE / spacing
        counts = 8 * np.ceil(rounds / 8.0).astype(np.intp)
        rows = np.repeat(np.arange(len(points)), counts)
        within = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
        step = self._turn / counts[rows]
        # Samples are in pairs. Of a part of a turn they stand so far apart that both the area and
        # the integral of the normal are exact: the surface closes.
        apart = 0.5 * step if self._whole else np.arccos(np.sinc(step / math.pi))
        angle = (2 * (within // 2) + 1) * step + np.where(within % 2, apart, -apart)
        c, s = np.cos(angle), np.sin(angle)
        r, z = points[rows].T
        flux = areas[rows] * (r * step)[:, None]
        ring = Surface(
            np.column_stack([r * c, r * s, z]),
            np.column_stack([flux[:, 0] * c, flux[:, 0] * s, flux[:, 1]]),
            tuple(names[rows].tolist()),
        )
        if self._whole:
            return ring
        ends = joined(self._ends(spacing))
        return Surface(
            np.concatenate([ring.points, ends.points]),
            np.concatenate([ring.area_vectors, ends.area_vectors]),
            (*ring.faces, *ends.faces),
        )

    def _ends(self, spacing: float) -> list[Piece]:
        inner, sizes = flat(self.of, spacing)
        kept = inner[:, 0] > 0.0
        (r, z), sizes = inner[kept].T, sizes[kept]
        pieces: list[Piece] = []
        for name, angle, sign in (("start", 0.0, -1.0), ("end", self._turn, 1.0)):
            c, s = math.cos(angle), math.sin(angle)
            area = sign * sizes[:, None] * np.array([-s, c, 0.0])
            pieces.append((name, np.column_stack([r * c, r * s, z]), area))
        return pieces

    def volume(self) -> float | None:
        """By Pappus' theorem, for a shape of straight edges, or beside the axis with a known
        centre."""
        lines = straight_outline(self.of)
        if lines is not None:
            return self._turn * right_integral(lines, 1, 0, 0.0)
        known = self.of.moments(np.zeros(2))
        if known is None or self.of.bounds()[0][0] <= 0.0:
            return None
        return self._turn * float(known.first[0])

    def moments(self, about: Array) -> Moments | None:
        """For a shape of straight edges."""
        lines = straight_outline(self.of)
        if lines is None:
            return None

        def of_shape(p: int, q: int) -> float:
            return right_integral(lines, p, q, float(about[2]))

        c, s, t = math.sin(self._turn), 1.0 - math.cos(self._turn), self._turn
        twice = 0.5 * math.sin(t) * math.cos(t)
        volume = t * of_shape(1, 0)
        first = np.array([c * of_shape(2, 0), s * of_shape(2, 0), t * of_shape(1, 1)])
        second = np.zeros((3, 3))
        second[:2, :2] = of_shape(3, 0) * np.array(
            [[0.5 * t + twice, 0.5 * c**2], [0.5 * c**2, 0.5 * t - twice]]
        )
        second[:2, 2] = second[2, :2] = np.array([c, s]) * of_shape(2, 1)
        second[2, 2] = t * of_shape(1, 2)
        # From the axis to the point.
        aside = np.append(about[:2], 0.0)
        second -= np.outer(first, aside) + np.outer(aside, first) - volume * np.outer(aside, aside)
        return Moments(volume, first - volume * aside, second)

    def nearest(self, points: Array) -> Array | None:
        """In the half plane of each point, for a full turn."""
        if not self._whole:
            return None
        radius = np.hypot(points[:, 0], points[:, 1])
        feet = self.of.nearest(np.column_stack([radius, points[:, 2]]))
        if feet is None:
            return None
        ways = np.where(radius[:, None] > 0.0, points[:, :2], (1.0, 0.0))
        ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
        return np.column_stack([feet[:, :1] * ways, feet[:, 1]])

    @cached_property
    def _turn(self) -> float:
        """The angle [rad]."""
        return math.radians(self.angle)

    @property
    def _whole(self) -> bool:
        return self.angle == 360.0
