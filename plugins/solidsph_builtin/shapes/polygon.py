"""Polygon: a region of the plane with straight edges."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from reprlib import repr as short
from typing import Any, ClassVar

import attrs
import numpy as np

from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_points, check_coordinates, refusal
from solidsph_builtin.shapes._outline import ClosedLines, first_crossing, next_of, pieces
from solidsph_builtin.shapes._sampling import ON_LINE, samples_along


def _as_ring(value: Any) -> Any:
    """Points without the first one repeated at the end; anything else unchanged."""
    points = as_points(value)
    closed = isinstance(points, tuple) and len(points) > 3 and points[0] == points[-1]
    return points[:-1] if closed else points


def _check_vertices(shape: Shape, field: attrs.Attribute[Any], value: object) -> None:
    if not (isinstance(value, tuple) and len(value) >= 3):
        raise refusal(shape, field.name, "a list of at least 3 points", short(value))
    for vertex in value:
        check_coordinates(2)(shape, field, vertex)


@attrs.frozen(slots=False)
class Polygon(Shape):
    """The points enclosed by straight edges from each of the `vertices` to the next.

    Vertices may run either way round, and the first may be repeated at the end, as drawings close
    their rings: the last edge is there in any case. Faces: edge-0 from the first vertex to the
    second, edge-1, and so on.

    Raises:
        SceneError: a vertex is not two finite numbers, there are fewer than 3, or the edges
            cross or touch each other, so that they enclose no single region.
    """

    vertices: tuple[tuple[float, ...], ...] = attrs.field(  # [m]
        converter=_as_ring, validator=_check_vertices
    )

    dimension: ClassVar[int] = 2
    example: ClassVar[Mapping[str, Any]] = {
        "vertices": [[0.0, 0.0], [1.2, 0.0], [0.5, 0.3], [0.0, 0.9]]
    }

    def __attrs_post_init__(self) -> None:
        starts, ends = self._edges()
        repeated = (starts == ends).all(axis=1)
        if repeated.any():
            vertex = self.vertices[int(np.argmax(repeated))]
            raise refusal(self, "vertices", "without repeats in a row", f"{vertex} twice")
        if self.volume() <= 1e-12 * np.ptp(starts, axis=0).max() ** 2:
            got = f"{self.volume()!r} m^2; use vertices off one line and edges that do not cross"
            raise refusal(self, "vertices", "around an area greater than zero", got)
        pair = first_crossing(starts, next_of([starts]))
        if pair is not None:
            got = f"one where edge-{pair[0]} meets edge-{pair[1]}; make one shape of each region"
            raise refusal(self, "vertices", "a closed line that never meets itself", got)

    @property
    def convex(self) -> bool:
        """True if it turns the same way at every vertex."""
        starts, ends = self._edges()
        edges = ends - starts
        following = np.roll(edges, -1, axis=0)
        turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
        turns *= self._signed_area()
        return bool(np.all(turns >= 0.0))

    def bounds(self) -> tuple[Array, Array]:
        vertices = np.array(self.vertices)
        return vertices.min(axis=0), vertices.max(axis=0)

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        return self.outline.signed_distance(points)

    def surface(self, spacing: float) -> Surface:
        """Samples with the exact length and normal of every edge."""
        starts, ends = self._edges()
        edges = ends - starts
        lengths = np.hypot(*edges.T).tolist()
        counts = np.array([samples_along(length, spacing, ON_LINE) for length in lengths])
        owners, middles = pieces(starts, edges, counts)
        normals = np.sign(self._signed_area()) * np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        names = [f"edge-{i}" for i in range(len(edges))]
        return Surface(
            points=middles,
            area_vectors=(normals / counts[:, np.newaxis])[owners],
            faces=tuple(names[i] for i in owners.tolist()),
        )

    def volume(self) -> float:
        return abs(self._signed_area())

    def moments(self, about: Array) -> Moments:
        return self.outline.moments(about)

    def nearest(self, points: Array) -> Array:
        return self.outline.nearest(points)

    @cached_property
    def outline(self) -> ClosedLines:
        """Its edges, counterclockwise."""
        starts = self._edges()[0]
        return ClosedLines.of([starts if self._signed_area() > 0.0 else starts[::-1]])

    def _edges(self) -> tuple[Array, Array]:
        """Start and end of each edge, each (m, 2) [m]."""
        starts = np.array(self.vertices)
        return starts, np.roll(starts, -1, axis=0)

    def _signed_area(self) -> float:
        """Area [m^2], negative where the vertices run clockwise."""
        # Relative to the first vertex, so that a body far from the origin loses no digits.
        x, y = (np.array(self.vertices) - self.vertices[0]).T
        return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
