"""Where triangles go through each other, or lie on each other in one plane."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.shapes._triangles import area_vectors

# Part of the size of two triangles by which they may meet: rounding.
_TOUCHES = 1e-7
_ROWS_AT_ONCE, _PAIRS_AT_ONCE = 1 << 13, 1 << 17


@attrs.frozen(eq=False)
class Meetings:
    """Where triangles meet by more than they touch."""

    crossing: Array | None  # a place (3,) where two go through each other, if they do [m]
    overlap: Array | None  # one that two in one plane have in common, if they do [m]


def first_meetings(vertices: Array, corners: Indices) -> Meetings:
    """A place where triangles cross, or else one where they overlap in a plane.

    Triangles without an area are passed over.

    Args:
        vertices: (m, 3) [m].
        corners: vertices of each triangle, (k, 3).
    """
    corners = corners[area_vectors(vertices[corners]).any(axis=1)]
    overlap = None
    for pairs in _near_pairs(vertices[corners]):
        for some in np.array_split(pairs, 1 + len(pairs) // _PAIRS_AT_ONCE):
            one, other = corners[some[:, 0]], corners[some[:, 1]]
            # Two along one edge can only lie on each other.
            apart = (one[:, :, None] == other[:, None, :]).sum(axis=(1, 2)) < 2
            for a, b in ((one[apart], other[apart]), (other[apart], one[apart])):
                place = _pierced(vertices, a, b)
                if place is not None:
                    return Meetings(place, None)
            if overlap is None:
                overlap = _overlapping(vertices[one], vertices[other])
    return Meetings(None, overlap)


def _near_pairs(triangles: Array) -> Iterator[Indices]:
    """Pairs (m, 2) of triangles (k, 3, 3) whose boxes meet, each pair once.

    Triangles of about one size are searched together, each size with itself and with larger ones:
    a search takes as long as its pairs, however much sizes differ.
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    middles, radii = 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1)
    octaves = np.floor(np.log2(radii / radii.min(initial=np.inf)))
    members = [np.flatnonzero(octaves == octave) for octave in np.unique(octaves)]
    trees = [cKDTree(middles[own]) for own in members]
    for a, b in combinations_with_replacement(range(len(members)), 2):
        reach = float(radii[members[a]].max() + radii[members[b]].max())
        for rows in np.array_split(members[a], 1 + len(members[a]) // _ROWS_AT_ONCE):
            found = cKDTree(middles[rows]).sparse_distance_matrix(
                trees[b], reach, output_type="ndarray"
            )
            i, j = rows[found["i"]], members[b][found["j"]]
            meet = (low[i] <= high[j]).all(axis=1) & (low[j] <= high[i]).all(axis=1)
            if a == b:
                meet &= i < j
            yield np.stack([i[meet], j[meet]], axis=1)


def _pierced(vertices: Array, one: Indices, other: Indices) -> Array | None:
    """A place where an edge of one triangle (m, 3) goes through the other (m, 3)."""
    triangles = vertices[other]
    normals = area_vectors(triangles)
    heights = np.einsum("mei,mi->me", vertices[one] - triangles[:, :1], normals)
    cut = np.flatnonzero((heights.min(axis=1) < 0.0) & (heights.max(axis=1) > 0.0))
    one, other, triangles, normals = one[cut], other[cut], triangles[cut], normals[cut]
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    normals, heights = normals / sizes, heights[cut] / sizes
    for k in range(3):
        m = (k + 1) % 3
        # Clearly on both sides of the plane, and no corner in common.
        through = heights[:, k] * heights[:, m] < 0.0
        rows = np.flatnonzero(through)
        ends = one[rows][:, [k, m]]
        h, start, way = (
            heights[rows, k],
            vertices[ends[:, 0]],
            np.diff(vertices[ends], axis=1)[:, 0],
        )
        clear = np.abs(heights[rows][:, [k, m]]).min(axis=1) > _TOUCHES * np.linalg.norm(
            way, axis=1
        )
        clear &= ~(ends[:, :, None] == other[rows][:, None, :]).any(axis=(1, 2))
        place = start + (h / (h - heights[rows, m]))[:, None] * way
        hit = np.flatnonzero(clear & _inside(place, triangles[rows], normals[rows]))
        if hit.size:
            return np.asarray(place[hit[0]])
    return None


def _inside(places: Array, triangles: Array, normals: Array) -> Mask:
    """Whether places (m, 3) in the planes of triangles (m, 3, 3) are inside or on an edge."""
    ways = np.roll(triangles, -1, axis=1) - triangles
    inward = np.cross(normals[:, None], ways)
    depths = np.einsum("mei,mei->me", places[:, None] - triangles, inward)
    return np.asarray((depths >= -_TOUCHES * np.sum(ways**2, axis=2)).all(axis=1))


def _overlapping(one: Array, other: Array) -> Array | None:
    """A place that triangles (m, 3, 3) in one plane have in common, beside their outlines."""
    areas = area_vectors(one)
    normals = areas / np.linalg.norm(areas, axis=1, keepdims=True)
    heights = np.einsum("mei,mi->me", other - one[:, :1], normals)
    sizes = np.linalg.norm(np.concatenate([one, other], axis=1).max(axis=1) - one[:, 0], axis=1)
    sizes = np.maximum(sizes, np.linalg.norm(other[:, 0] - other[:, 1], axis=1))
    flat = np.flatnonzero(np.abs(heights).max(axis=1, initial=0.0) <= _TOUCHES * sizes)
    one, other, normals, sizes = one[flat], other[flat], normals[flat], sizes[flat]
    apart = np.zeros(len(flat), dtype=np.bool_)
    for triangles in (one, other):
        ways = np.roll(triangles, -1, axis=1) - triangles
        across = np.cross(normals[:, None], ways)
        across /= np.linalg.norm(across, axis=2, keepdims=True)
        for k in range(3):  # two convex outlines that a line parts have nothing in common
            a, b = (np.einsum("mei,mi->me", t - one[:, :1], across[:, k]) for t in (one, other))
            common = np.minimum(a.max(axis=1), b.max(axis=1))
            common -= np.maximum(a.min(axis=1), b.min(axis=1))
            apart |= common <= _TOUCHES * sizes
    if apart.all():
        return None
    first = int(np.argmin(apart))
    low = np.maximum(one[first].min(axis=0), other[first].min(axis=0))
    high = np.minimum(one[first].max(axis=0), other[first].max(axis=0))
    return np.asarray(0.5 * (low + high))
