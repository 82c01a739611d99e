"""Outline: a plane body with a drawn outline, in a file or as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._checks import as_points, as_tuple
from solidsph_builtin.shapes._drawing_files import MOST_BYTES, Line, read_lines
from solidsph_builtin.shapes._file_fields import angle_field, path_field, read_bytes
from solidsph_builtin.shapes._outline import ClosedLines, pieces
from solidsph_builtin.shapes._placement import (
    UNITS,
    Placement,
    check_placement,
    rotation_field,
    scale_field,
    translation_field,
    unit_field,
)
from solidsph_builtin.shapes._rings import Ring, edge_names, rings_of
from solidsph_builtin.shapes._sampling import ON_LINE, samples_along


def _as_rings(value: Any) -> Any:
    return value if value is None else as_tuple(value, as_points)


@final
@attrs.frozen(slots=False)
class Outline(Shape):
    """A plane body between closed lines: a ring within another is a hole, one in that a part.

    They come from a `file`: SVG, DXF, or CSV with rows of two coordinates and a blank line between
    rings. Or they are given as `rings`, lists of points. Curves become straight edges that miss
    them by 1e-5 of the size of the drawing. Lines that meet at their ends are joined.

    Lengths are in the `unit` of the file, times `scale`; of SVG in its own coordinates, with y
    upwards. The body is then turned by `rotate` [degrees] about the origin, and moved by
    `translate`.

    Faces are the layers of DXF but for layer 0, and the elements of SVG with an id. Other edges are
    parted at corners that turn by more than `edge_angle`, into edge-1, edge-2 and so on.

    Raises:
        SceneError: neither or both of a file and rings are given, the file cannot be read, or lines
            have loose ends, or cross or touch each other.
    """

    file: str | None = path_field()
    rings: tuple[tuple[tuple[float, ...], ...], ...] | None = attrs.field(
        default=None, converter=_as_rings
    )
    unit: str = unit_field()
    scale: float = scale_field()
    rotate: tuple[float, ...] = rotation_field()  # [degrees]
    translate: tuple[float, ...] = translation_field()  # [m]
    edge_angle: float = angle_field()  # [degrees]

    dimension: ClassVar[int] = 2
    example: ClassVar[Mapping[str, Any]] = {
        "rings": [
            [[0.0, 0.0], [1.2, 0.0], [1.2, 0.8], [0.0, 0.8]],
            [[0.4, 0.2], [0.8, 0.2], [0.6, 0.6]],
        ]
    }

    def __attrs_post_init__(self) -> None:
        check_placement(self, 2, self.rotate, self.translate)
        if (self.file is None) == (self.rings is None):
            given = "neither" if self.file is None else "both"
            raise SceneError(f"shape 'outline': give one of file and rings, got {given}")
        self._rings  # noqa: B018  what is wrong is told now

    def bounds(self) -> tuple[Array, Array]:
        corners = np.concatenate([ring.corners for ring in self._rings])
        return corners.min(axis=0), corners.max(axis=0)

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        return self.outline.signed_distance(points)

    @property
    def convex(self) -> bool:
        """True if there is one ring that turns the same way at every corner."""
        ways, other = self.outline.edges, self.outline.edges[self.outline.following]
        turns = ways[:, 0] * other[:, 1] - ways[:, 1] * other[:, 0]
        return len(self._rings) == 1 and bool(np.all(turns >= 0.0))

    def surface(self, spacing: float) -> Surface:
        """Samples with the exact length and normal of every edge."""
        lines = self.outline
        lengths = np.linalg.norm(lines.edges, axis=1)
        counts = np.array([samples_along(one, spacing, ON_LINE) for one in lengths.tolist()])
        owners, middles = pieces(lines.starts, lines.edges, counts)
        areas = lines.normals[owners] * (lengths / counts)[owners, None]
        return Surface(middles, areas, tuple(self._names[n] for n in owners.tolist()))

    def volume(self) -> float:
        return self.moments(self.bounds()[0]).volume

    def moments(self, about: Array) -> Moments:
        return self.outline.moments(about)

    def nearest(self, points: Array) -> Array:
        return self.outline.nearest(points)

    @cached_property
    def outline(self) -> ClosedLines:
        """Its edges, counterclockwise around the inside."""
        return ClosedLines.of([ring.corners for ring in self._rings])

    @cached_property
    def _names(self) -> list[str]:
        return edge_names(self._rings, self.edge_angle)

    @cached_property
    def _rings(self) -> list[Ring]:
        what = "shape 'outline'" if self.file is None else f"shape 'outline': file {self.file!r}"
        placement = Placement.of(2, UNITS[self.unit] * self.scale, self.rotate, self.translate)
        try:
            rings = rings_of(self._drawn())
        except (OSError, ValueError, MemoryError) as cause:
            raise SceneError(f"{what}: {cause}") from cause
        return [Ring(placement.placed(ring.corners), ring.groups) for ring in rings]

    def _drawn(self) -> list[Line]:
        if self.file is not None:
            data = read_bytes(self.file, MOST_BYTES)
            return read_lines(data, Path(self.file).suffix.lower(), self.unit)
        lines = []
        for ring in self.rings or ():
            points = np.array(ring, dtype=np.float64)
            if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
                raise ValueError("rings must be lists of points with two finite coordinates")
            lines.append(Line(points, closed=True))
        if not lines:
            raise ValueError("there are no rings")
        return lines
