"""Cells of finite element meshes: the triangles of their outer surface, and their groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from solidsph.maths.arrays import Array, Indices

# Triangles of the faces of each kind of cell, seen from outside. A triangle of the second degree
# is taken as four.
_SIX = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
_SURFACES: Mapping[str, tuple[tuple[int, int, int], ...]] = {
    "triangle": ((0, 1, 2),),
    "triangle6": _SIX,
    "quad": ((0, 1, 2), (0, 2, 3)),
}


def _second_degree(*faces: tuple[int, int, int, int, int, int]) -> Iterator[tuple[int, int, int]]:
    for face in faces:
        yield from ((face[a], face[b], face[c]) for a, b, c in _SIX)


_SOLIDS: Mapping[str, tuple[tuple[int, int, int], ...]] = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "tetra10": tuple(
        _second_degree(
            (0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (2, 0, 3, 6, 7, 9)
        )
    ),
}
# Cells whose faces have four corners, in rings seen from outside.
_RINGS: Mapping[str, tuple[tuple[int, ...], ...]] = {
    "hexahedron": (
        (0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)
    ),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}  # fmt: skip
_FLAT = ("vertex", "line", "line3")


def outer_triangles(mesh: Any) -> tuple[Array, Indices, list[str]]:
    """Points (m, 3), triangles (k, 3) and their groups (k,) of a mesh with cells as meshio has it.

    Of solid cells these are the faces that belong to one cell only. They are in the groups of the
    surface cells, or of the sets of points, with the same corners.

    Raises:
        ValueError: it has cells of another kind.
    """
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError("its points have no three coordinates")
    surfaces, names, solids = [], [], []
    for block, cells in enumerate(mesh.cells):
        corners = np.asarray(cells.data, dtype=np.intp)
        if cells.type in _SURFACES:
            found = _taken(corners, _SURFACES[cells.type])
            surfaces.append(found)
            own = _groups_of_block(mesh, block, len(corners))
            names += [name for name in own for _ in _SURFACES[cells.type]]
        elif cells.type in _SOLIDS:
            solids.append(_taken(corners, _SOLIDS[cells.type]))
        elif cells.type in _RINGS:
            solids += [_halved(corners[:, list(ring)]) for ring in _RINGS[cells.type]]
        elif cells.type not in _FLAT:
            known = ", ".join((*_SURFACES, *_SOLIDS, *_RINGS))
            raise ValueError(f"cells of the kind {cells.type!r} are not read; use {known}")
    none = np.empty((0, 3), dtype=np.intp)
    drawn = np.concatenate([none, *surfaces])
    if not solids:
        return points, drawn, _named_by_points(mesh, drawn, names)
    outer = _unpaired(np.concatenate(solids))
    in_group = dict(zip(map(tuple, np.sort(drawn, axis=1).tolist()), names, strict=True))
    groups = [in_group.get(tuple(key), "") for key in np.sort(outer, axis=1).tolist()]
    return points, outer, _named_by_points(mesh, outer, groups)


def _taken(cells: Indices, triangles: tuple[tuple[int, int, int], ...]) -> Indices:
    return cells[:, np.array(triangles)].reshape(-1, 3)


def _halved(rings: Indices) -> Indices:
    """Triangles of faces with three or four corners (n, 3 or 4).

    A face is cut from its lowest corner, so that the two cells beside it agree.
    """
    if rings.shape[1] == 3:
        return rings
    first = np.argmin(rings, axis=1)[:, None]
    rings = np.take_along_axis(rings, (first + np.arange(4)) % 4, axis=1)
    return _taken(rings, _SURFACES["quad"])


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
