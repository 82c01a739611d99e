"""Cells of finite element meshes: the triangles of their outer surface, and their groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from solidsph.maths.arrays import Array, Indices

# Corners of the faces of each kind of cell, in rings seen from outside, as Abaqus counts the faces.
_FACES: Mapping[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2, 3),),
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "hexahedron": (
        (0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)
    ),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}  # fmt: skip
_CORNERS = {"triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}

# Edges that have a point in their middle, in the order of these points, which come after the
# corners. Points in the middle of faces and cells follow, and are not needed.
_BASE = ((0, 1), (1, 2), (2, 3), (3, 0))
_EDGES: Mapping[str, tuple[tuple[int, int], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": _BASE,
    "tetra": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hexahedron": (
        *_BASE, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)
    ),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "pyramid": (*_BASE, (0, 4), (1, 4), (2, 4), (3, 4)),
}  # fmt: skip
_SECOND_DEGREE: Mapping[str, str] = {
    "triangle6": "triangle",
    "triangle7": "triangle",
    "quad8": "quad",
    "quad9": "quad",
    "tetra10": "tetra",
    "hexahedron20": "hexahedron",
    "hexahedron27": "hexahedron",
    "wedge15": "wedge",
    "pyramid13": "pyramid",
}
_SURFACES = ("triangle", "quad")
_FLAT = ("vertex", "line", "line3")


def outer_triangles(
    mesh: Any, faces_of_sets: Mapping[str, Sequence[tuple[str, int]]]
) -> tuple[Array, Indices, list[str]]:
    """Points (m, 3), triangles (k, 3) and their groups (k,) of a mesh with cells as meshio has it.

    Of solid cells these are the faces that belong to one cell only. They are in the groups of the
    surface cells with the same corners, in those of `faces_of_sets`, or in those of the sets of
    points that have all their corners.

    Args:
        mesh: the mesh.
        faces_of_sets: groups of faces of solid cells: the cells of a set, and the face of each,
            counted from 1.

    Raises:
        ValueError: it has cells of another kind.
    """
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError("its points have no three coordinates")
    surfaces: list[Indices] = []
    names: list[str] = []
    solids: list[Indices] = []
    in_group: dict[tuple[int, ...], str] = {}
    for block, cells in enumerate(mesh.cells):
        corners = np.asarray(cells.data, dtype=np.intp)
        if cells.type in _FLAT:
            continue
        kind = _SECOND_DEGREE.get(cells.type, cells.type)
        if kind not in _FACES:
            known = ", ".join((*_FACES, *_SECOND_DEGREE))
            raise ValueError(f"cells of the kind {cells.type!r} are not read; use {known}")
        faces = _triangles(kind, corners, second_degree=kind != cells.type)
        found = [triangles for face in faces for triangles in face]
        if kind in _SURFACES:
            surfaces += found
            names += _groups_of_block(mesh, block, len(corners)) * len(found)
            continue
        solids += found
        for name, parts in faces_of_sets.items():
            for cell_set, face in parts:
                members = _members(mesh, cell_set, block)
                for triangles in faces[face - 1] if face <= len(faces) else ():
                    in_group |= dict.fromkeys(_keys(triangles[members]), name)
    none = np.empty((0, 3), dtype=np.intp)
    drawn = np.concatenate([none, *surfaces])
    if not solids:
        return points, drawn, _named_by_points(mesh, drawn, names)
    outer = _unpaired(np.concatenate(solids))
    drawn_in = dict(zip(_keys(drawn), names, strict=True))
    groups = [drawn_in.get(key) or in_group.get(key, "") for key in _keys(outer)]
    return points, outer, _named_by_points(mesh, outer, groups)


def _keys(triangles: Indices) -> list[tuple[int, ...]]:
    """What tells triangles (k, 3) apart, whichever way round."""
    return [tuple(key) for key in np.sort(triangles, axis=1).tolist()]


def _members(mesh: Any, cell_set: str, block: int) -> Indices:
    """Cells of a block in a set, whose name is in any case, as Abaqus takes it."""
    for name, members in mesh.cell_sets.items():
        if name.upper() == cell_set.upper() and members[block] is not None:
            return np.asarray(members[block], dtype=np.intp).ravel()
    return np.empty(0, dtype=np.intp)


def _triangles(kind: str, cells: Indices, *, second_degree: bool) -> list[list[Indices]]:
    """Triangles of each face of `cells` (n, c), each (n, 3).

    A face of the second degree has one at each corner, and what is between them.
    """
    faces = []
    for face in _FACES[kind]:
        found: list[Indices] = []
        ring = cells[:, list(face)]
        if second_degree:
            edges = [set(edge) for edge in _EDGES[kind]]
            places = [edges.index({a, b}) for a, b in zip(face, (*face[1:], face[0]), strict=True)]
            middles = cells[:, [_CORNERS[kind] + place for place in places]]
            before = np.roll(middles, 1, axis=1)
            found = [
                np.column_stack([ring[:, c], middles[:, c], before[:, c]]) for c in range(len(face))
            ]
            ring = middles
        faces.append([*found, *_halved(ring)])
    return faces


def _halved(rings: Indices) -> list[Indices]:
    """Triangles of rings of three or four points (n, 3 or 4), each (n, 3).

    A ring of four is cut from its lowest point, so that the two cells beside it agree.
    """
    if rings.shape[1] == 3:
        return [rings]
    first = np.argmin(rings, axis=1)[:, None]
    rings = np.take_along_axis(rings, (first + np.arange(4)) % 4, axis=1)
    return [rings[:, [0, 1, 2]], rings[:, [0, 2, 3]]]


def _unpaired(triangles: Indices) -> Indices:
    """The triangles that occur once, whichever way round, in their order."""
    keys = np.sort(triangles, axis=1)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    once: Indices = triangles[np.sort(first[counts == 1])]
    return once


def _groups_of_block(mesh: Any, block: int, count: int) -> list[str]:
    """The group of each of the cells of a block, the last that it is in; empty for none.

    In files of Abaqus the sets that an element was defined with come first."""
    names = [""] * count
    for name, members in mesh.cell_sets.items():
        if name.startswith("gmsh:"):
            continue
        own = members[block]
        for cell in () if own is None else np.asarray(own).ravel().tolist():
            names[cell] = name
    titles = {tuple(number): name for name, number in _numbered(mesh.field_data)}
    for key, values in mesh.cell_data.items():
        array = np.asarray(values[block])
        if key == "gmsh:geometrical" or array.ndim != 1 or array.dtype.kind not in "iu":
            continue
        for cell, number in enumerate(array.tolist()):
            title = titles.get((number, 2)) if key == "gmsh:physical" else ""
            if number > 0 and not names[cell]:
                names[cell] = title or f"{key.rpartition(':')[2]}-{number}"
    return names


def _numbered(field_data: Mapping[str, Any]) -> Iterator[tuple[str, list[int]]]:
    for name, values in field_data.items():
        array = np.asarray(values).ravel()
        if array.shape == (2,) and array.dtype.kind in "iu":
            yield name, array.tolist()


def _named_by_points(mesh: Any, triangles: Indices, groups: list[str]) -> list[str]:
    """The groups, and of triangles in none the first set of points that has all their corners."""
    for name, members in mesh.point_sets.items():
        inside = np.zeros(len(mesh.points), dtype=np.bool_)
        inside[np.asarray(members, dtype=np.intp)] = True
        for triangle in np.flatnonzero(inside[triangles].all(axis=1)).tolist():
            groups[triangle] = groups[triangle] or name
    return groups
