"""Shape: the region that a body fills in the reference configuration."""

from __future__ import annotations

from abc import abstractmethod

import attrs

from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class Surface:
    """Samples of a boundary: together their area vectors integrate over it."""

    points: Array  # (m, d) [m]
    area_vectors: Array  # (m, d) outward normal times the area of the sample [m^(d-1)]
    faces: tuple[str, ...]  # (m,) the named face that each sample lies on


class Shape(Part):
    """A closed region in 1, 2 or 3 dimensions.

    An implementation is a frozen attrs class whose fields are the TOML keys of the shape.
    Faces normal to an axis are called left/right (x), bottom/top (y), front/back (z).
    """

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of space dimensions, 1 to 3."""

    @abstractmethod
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner of a box that holds the shape, each (d,) [m]."""

    @abstractmethod
    def signed_distance(self, points: Array) -> Array:
        """Distance to the boundary of each of `points` (n, d), negative inside, (n,) [m].

        Exact in sign everywhere, and in value near the boundary away from corners; elsewhere no
        more than the distance, so that a point is inside as far around as its depth.
        """

    @property
    def convex(self) -> bool:
        """Whether every straight line between two points of the shape stays inside it.

        Where it does, no lines between neighbours need be followed. False if not known.
        """
        return False

    @abstractmethod
    def surface(self, spacing: float) -> Surface:
        """The boundary, sampled at most `spacing` [m] apart."""

    @abstractmethod
    def volume(self) -> float | None:
        """Length, area or volume [m^d]; None where no closed form is known."""
