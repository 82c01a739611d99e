"""Faces of a surface of triangles: groups of a file, and parts between sharp edges."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from solidsph.maths.arrays import Array, Indices
from solidsph.model.regions import is_reserved
from solidsph_builtin.shapes._triangles import area_vectors, edges_of, groups_of

# So many faces are named; smaller ones are one face together, as of a rough scan.
_MOST = 200


def patches(
    vertices: Array, corners: Indices, groups: Sequence[str], sharp: float
) -> tuple[tuple[str, ...], Indices]:
    """Names of faces, and the number of that which each triangle belongs to, (k,).

    The triangles of a group are a face. Others are parted along edges that bend by more than
    `sharp` [degrees], into face-1, face-2 and so on, in the order of their first triangle.
    """
    names = sorted({tag_of(group) for group in groups if group})
    given = np.array([names.index(tag_of(g)) if g else -1 for g in groups], dtype=np.intp)
    areas = area_vectors(vertices[corners])
    sizes = np.linalg.norm(areas, axis=1)
    normals = areas / np.where(sizes > 0.0, sizes, 1.0)[:, None]
    _, beside = edges_of(corners)
    first, second = beside.T
    smooth = np.einsum("ei,ei->e", normals[first], normals[second]) >= np.cos(np.radians(sharp))
    # A needle without any area has no normal, and belongs to what is beside it.
    smooth |= (sizes[first] == 0.0) | (sizes[second] == 0.0)
    smooth &= (given[first] < 0) & (given[second] < 0)
    owners = given.copy()
    parts = [part for part in groups_of(len(corners), beside[smooth]) if given[part[0]] < 0]
    if len(parts) > _MOST:
        largest = sorted(parts, key=lambda part: -float(sizes[part].sum()))[: _MOST - 1]
        named = {int(part[0]) for part in largest}
        rest = [part for part in parts if int(part[0]) not in named]
        parts = [part for part in parts if int(part[0]) in named] + [np.concatenate(rest)]
    for number, part in enumerate(parts):
        owners[part] = len(names) + number
    taken = set(names)
    fresh = (f"face-{i}" for i in range(1, len(parts) + len(taken) + 1) if f"face-{i}" not in taken)
    return (*names, *(next(fresh) for _ in parts)), owners


def tag_of(name: str) -> str:
    """A name as conditions can have it: letters, digits and hyphens, a letter first.

    With `face-` before it, if it has another meaning there.
    """
    tag = re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-")
    if not tag:
        return "face"
    return tag if tag[0].isalpha() and not is_reserved(tag) else f"face-{tag}"
