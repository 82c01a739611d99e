"""What keeps triangles from being the surface of a body, one fault a function."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.shapes._mesh_crossings import first_meetings
from solidsph_builtin.shapes._triangles import Triangles, area_vectors, pieces_of

# Part of the size of a triangle from which its inside is looked at.
_BESIDE = 1e-3


def faults(vertices: Array, corners: Indices) -> Iterator[str]:
    """Yield what is wrong, where, and the remedy; the first fault may cause those after it.

    Args:
        vertices: (m, 3) [m].
        corners: vertices of each triangle, (k, 3), three different ones.
    """
    yield from _not_finite(vertices, corners)
    yield from _twice(vertices, corners)
    yield from _open(vertices, corners)
    yield from _turned(vertices, corners)
    surface = Triangles(vertices, corners, ("all",), np.zeros(len(corners), dtype=np.intp))
    meetings = first_meetings(vertices, corners)
    if meetings.crossing is not None:
        yield (
            f"it crosses itself at {_numbers(meetings.crossing)} m; cut it there, or unite its "
            "parts where it was drawn (in a scene: one mesh each, and the shape 'union')"
        )
    yield from _wrong_sides(surface)
    if meetings.overlap is not None:
        yield (
            f"two triangles lie on each other at {_numbers(meetings.overlap)} m; remove the fold, "
            "or unite its parts where it was drawn (in a scene: one mesh each, and the shape "
            "'union')"
        )


def _not_finite(vertices: Array, corners: Indices) -> Iterator[str]:
    bad = np.asarray(~np.isfinite(vertices[corners]).all(axis=(1, 2)))
    if bad.any():
        first = int(np.argmax(bad))
        yield (
            f"{_count(bad)} of {len(corners)} triangles have corners that are not finite, first "
            f"number {first}: {vertices[corners[first]].tolist()}; export the file again"
        )


def _twice(vertices: Array, corners: Indices) -> Iterator[str]:
    keys = np.sort(corners, axis=1)
    order = np.lexsort(keys.T)
    same = np.r_[False, (np.diff(keys[order], axis=0) == 0).all(axis=1)]
    if same.any():
        yield (
            f"{_count(same)} triangles are there twice, first at "
            f"{_place(vertices[corners[order[np.argmax(same)]]])}; set repair = true, or remove "
            "them"
        )


def _open(vertices: Array, corners: Indices) -> Iterator[str]:
    edges = _free_edges(corners)
    if len(edges):
        yield (
            f"it is not closed: {len(edges)} edges have a triangle on one side only, first at "
            f"{_place(vertices[edges[0]])}; set repair = true to fill its holes, or close them "
            "where it was drawn"
        )


def _free_edges(corners: Indices) -> Indices:
    """Edges (e, 2) of an odd number of triangles."""
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2))
    found, counts = np.unique(edges, axis=0, return_counts=True)
    return np.asarray(found[counts % 2 == 1])


def _turned(vertices: Array, corners: Indices) -> Iterator[str]:
    """Edges along which both triangles run the same way."""
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    keys = np.minimum(starts, ends) * len(vertices) + np.maximum(starts, ends)
    found, which = np.unique(keys, return_inverse=True)
    balance = np.bincount(which, np.where(starts < ends, 1.0, -1.0), minlength=len(found))
    bad = balance[which] != 0.0
    if bad.any():
        first = int(np.argmax(bad))
        yield (
            f"some of its triangles are inverted: along {len(np.unique(keys[bad]))} edges two "
            f"neighbours run opposite ways round, first at "
            f"{_place(vertices[[starts[first], ends[first]]])}; set repair = true, or make the "
            "normals consistent where it was drawn"
        )


def _wrong_sides(surface: Triangles) -> Iterator[str]:
    """Parts with the body in front of them, or on both sides."""
    for part in pieces_of(surface.corners):
        behind, ahead = sides(surface, part)
        place = _place(surface.vertices[surface.corners[part[0]]])
        if (behind, ahead) == (0, -1):
            yield (
                f"it is inverted: seen from outside, its triangles run clockwise, as at {place}; "
                "set repair = true, or flip its normals where it was drawn"
            )
        elif (behind, ahead) == (1, 1):
            yield (
                f"two closed parts of it touch at {place}; unite them where it was drawn (in a "
                "scene: one mesh each, and the shape 'union')"
            )
        elif (behind, ahead) != (1, 0):
            yield (
                f"a closed part of it lies within another, with normals that say it is no hole, or "
                f"in the same place, at {place}; set repair = true to make it a hole, or remove it"
            )


def sides(surface: Triangles, part: Indices) -> tuple[int, int]:
    """How often the surface runs around a place just behind, and just in front of, the largest
    triangle of a part."""
    triangles = surface.vertices[surface.corners[part]]
    areas = area_vectors(triangles)
    sizes = np.linalg.norm(areas, axis=1)
    largest = int(np.argmax(sizes))
    if sizes[largest] == 0.0:
        return 1, 0
    step = areas[largest] / np.sqrt(sizes[largest]) * _BESIDE
    middle = triangles[largest].mean(axis=0)
    behind, ahead = np.rint(surface.winding_numbers(np.stack([middle - step, middle + step])))
    return int(behind), int(ahead)


def _count(mask: Mask) -> int:
    return int(np.sum(mask))


def _place(points: Array) -> str:
    return f"{_numbers(points.mean(axis=0))} m"


def _numbers(point: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ")"
