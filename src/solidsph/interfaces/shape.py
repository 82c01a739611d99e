"""Shape: the region that a body fills in the reference configuration."""

from __future__ import annotations

from abc import abstractmethod

import attrs
import numpy as np

from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class Surface:
    """Samples of a boundary whose area vectors add up to its integral."""

    points: Array  # (m, d) [m]
    area_vectors: Array  # (m, d) outward normal times the area of the sample [m^(d-1)]
    faces: tuple[str, ...]  # (m,) the named face of each sample


@attrs.frozen(eq=False)
class Moments:
    """Integrals over a shape, with x from some point."""

    volume: float  # of 1 [m^d]
    first: Array  # of x, (d,) [m^(d+1)]
    second: Array  # of x x^T, (d, d) [m^(d+2)]


class Shape(Part):
    """A closed region in 1, 2 or 3 dimensions.

    An implementation is a frozen attrs class whose fields are the TOML keys of the shape. Faces
    normal to an axis are called left/right (x), bottom/top (y), front/back (z).
    """

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of space dimensions, 1 to 3."""

    @abstractmethod
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner of a box that contains the shape, each (d,) [m]."""

    @abstractmethod
    def signed_distance(self, points: Array) -> Array:
        """Signed distance to the boundary of `points` (n, d), negative inside, (n,) [m].

        Its sign is exact everywhere, its value near the boundary away from corners. Elsewhere it
        does not exceed the distance, so that a ball of that radius around an inner point is inside.
        """

    @property
    def convex(self) -> bool:
        """True if every straight line between two points of the shape is inside it.

        Lines of sight between neighbours are then not checked. False if it is not known.
        """
        return False

    @abstractmethod
    def surface(self, spacing: float) -> Surface:
        """The boundary, sampled at most `spacing` [m] apart."""

    @abstractmethod
    def volume(self) -> float | None:
        """Length, area or volume [m^d]; None if no closed form is known."""

    def moments(self, about: Array) -> Moments | None:
        """Exact moments about a point (d,) [m]; None if no closed form is known."""
        return None

    def nearest(self, points: Array) -> Array | None:
        """The places on the boundary nearest to `points` (n, d), (n, d) [m]; None if they are only
        known by the distance."""
        return None

    def distance_within(self, points: Array, reach: float) -> Array:
        """`signed_distance` of `points` (n, d), no further than `reach` from 0, (n,) [m].

        A shape for which points far from the boundary cost most answers this more quickly.
        """
        return np.clip(self.signed_distance(points), -reach, reach)
