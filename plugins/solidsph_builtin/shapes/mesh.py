"""Mesh: a body whose surface is given by triangles, in a file or as numbers."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from reprlib import repr as short
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._file_fields import angle_field, path_field, read_bytes
from solidsph_builtin.shapes._mesh_faults import faults
from solidsph_builtin.shapes._mesh_files import MOST_BYTES, Soup, read_soup
from solidsph_builtin.shapes._mesh_repair import merged, proper, repaired
from solidsph_builtin.shapes._patches import patches
from solidsph_builtin.shapes._placement import (
    UNITS,
    Placement,
    check_placement,
    rotation_field,
    scale_field,
    translation_field,
    unit_field,
)
from solidsph_builtin.shapes._recent_values import RecentValues
from solidsph_builtin.shapes._triangles import Triangles

_RECENT: RecentValues[Triangles] = RecentValues(8)
"""Surfaces by the content of their file and the parameters.

A scene makes a shape several times: as it is read, estimated and built, and again for every
spacing of a search. To check a mesh of 3e5 triangles takes ten seconds. A surface is never changed,
and its key is all that it depends on, so that who has it already cannot be seen.
"""

_SOURCES = ("file", "vertices", "triangles")


def _as_rows(value: Any) -> Any:
    """Numbers as nested tuples; anything else unchanged, for the check to refuse."""
    try:
        return None if value is None else tuple(map(tuple, np.asarray(value).tolist()))
    except (TypeError, ValueError):
        return value


@final
@attrs.frozen(slots=False)
class Mesh(Shape):
    """A body in space, enclosed by triangles.

    They come from a `file`, whose name says what it is: STL, OBJ or PLY; Gmsh (.msh), Abaqus
    (.inp) or VTU, of whose solid cells the outer faces count; STEP (.step, .stp). Or they are given
    as `vertices` and `triangles`, three numbers of vertices each, counterclockwise from outside.
    A relative path begins in the folder of the scene file, in Python in the working folder.

    Lengths are in the `unit` of the file, times `scale`; the body is then turned by `rotate`, about
    the axes x, y and z, one after the other, and moved by `translate`.

    Faces are the named groups of the file: solids of a text STL, groups of OBJ, physical groups of
    Gmsh, sets of Abaqus. Others are parted along edges that bend by more than `edge_angle`, into
    face-1, face-2 and so on, in the order of the file.

    Raises:
        SceneError: neither or both of a file and triangles are given, the file cannot be read, or
            the triangles do not enclose a body: they leave a hole, are there twice, run clockwise,
            or cross each other. All but the last is mended by `repair`.
    """

    file: str | None = path_field()
    vertices: tuple[tuple[float, ...], ...] | None = attrs.field(default=None, converter=_as_rows)
    triangles: tuple[tuple[int, ...], ...] | None = attrs.field(default=None, converter=_as_rows)
    unit: str = unit_field()
    scale: float = scale_field()
    rotate: tuple[float, ...] = rotation_field()  # [degrees]
    translate: tuple[float, ...] = translation_field()  # [m]
    edge_angle: float = angle_field()  # [degrees]
    repair: bool = attrs.field(default=False, validator=attrs.validators.instance_of(bool))

    dimension: ClassVar[int] = 3
    # A tetrahedron with three edges along the axes.
    example: ClassVar[Mapping[str, Any]] = {
        "vertices": [[0.0, 0.0, 0.0], [1.2, 0.0, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 0.8]],
        "triangles": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }

    def __attrs_post_init__(self) -> None:
        check_placement(self, 3, self.rotate, self.translate)
        given = [name for name in _SOURCES if getattr(self, name) is not None]
        if given not in (["file"], ["vertices", "triangles"]):
            got = " and ".join(given) or "nothing"
            raise SceneError(
                f"shape 'mesh': give either a file, or vertices and triangles, got {got}"
            )
        self._surface  # noqa: B018  what is wrong is told now

    def bounds(self) -> tuple[Array, Array]:
        return self._surface.bounds()

    def signed_distance(self, points: Array) -> Array:
        """The distance, exact everywhere."""
        return self._surface.signed_distance(points)

    @property
    def convex(self) -> bool:
        """True if it is in one piece and bends outwards along every edge."""
        return self._surface.convex

    def surface(self, spacing: float) -> Surface:
        """The middles of pieces of the triangles."""
        return self._surface.surface(spacing)

    def volume(self) -> float:
        return self._surface.moments(self.bounds()[0]).volume

    def moments(self, about: Array) -> Moments:
        return self._surface.moments(about)

    def distance_within(self, points: Array, reach: float) -> Array:
        return self._surface.distance_within(points, reach)

    def nearest(self, points: Array) -> Array:
        return self._surface.nearest(points)

    @cached_property
    def _surface(self) -> Triangles:
        what = "shape 'mesh'" if self.file is None else f"shape 'mesh': file {self.file!r}"
        try:
            if self.file is None:
                return self._enclosed(_listed(self.vertices, self.triangles))
            suffix = Path(self.file).suffix.lower()
            if suffix in (".step", ".stp") and self.unit != "m":
                raise ValueError(f"it holds its own unit; leave out unit = {self.unit!r}")
            data = read_bytes(self.file, MOST_BYTES)
            key = (hashlib.sha256(data).hexdigest(), suffix, *self._parameters())
            return _RECENT.value(key, lambda: self._enclosed(read_soup(data, suffix)))
        except (OSError, ValueError, MemoryError) as cause:
            raise SceneError(f"{what}: {cause}") from cause

    def _parameters(self) -> tuple[Any, ...]:
        return (
            *(self.unit, self.scale, self.rotate, self.translate),
            *(self.edge_angle, self.repair),
        )

    def _enclosed(self, soup: Soup) -> Triangles:
        """The surface that the triangles of a file make up, in its place.

        Raises:
            ValueError: they enclose no body.
        """
        placement = Placement.of(3, UNITS[self.unit] * self.scale, self.rotate, self.translate)
        vertices, corners = merged(placement.placed(soup.vertices), soup.corners)
        # What has lost a corner has no area.
        some = proper(corners)
        corners, groups = corners[some], [soup.groups[n] for n in some.tolist()]
        owners = np.arange(len(corners))
        if self.repair:
            vertices, corners, owners = repaired(vertices, corners, owners)
        fault = next(faults(vertices, corners), None)
        if fault is not None:
            raise ValueError(fault)
        names, faces = patches(
            vertices, corners, [groups[n] for n in owners.tolist()], self.edge_angle
        )
        return Triangles(vertices, corners, names, faces)


def _listed(vertices: object, triangles: object) -> Soup:
    """Given numbers as triangles.

    Raises:
        ValueError: they are something else.
    """
    points, corners = np.array(vertices, dtype=np.float64), np.array(triangles)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"vertices must be rows of 3 coordinates, got {short(vertices)}")
    if corners.ndim != 2 or corners.shape[1] != 3 or corners.dtype.kind not in "iu":
        raise ValueError(f"triangles must be rows of 3 whole numbers, got {short(triangles)}")
    if corners.min() < 0 or corners.max() >= len(points):
        raise ValueError(
            f"triangles must be numbers of vertices from 0 to {len(points) - 1}, got "
            f"{corners.min()} to {corners.max()}"
        )
    return Soup(points, corners.astype(np.intp), [""] * len(corners))
