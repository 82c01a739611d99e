"""Repair of a surface of triangles: what can be mended without a guess at its form."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.shapes._libraries import geometry_library
from solidsph_builtin.shapes._mesh_faults import sides
from solidsph_builtin.shapes._triangles import Triangles, groups_of, pieces_of

# Vertices closer than this part of the size are one.
_CLOSE = 1e-6


def merged(vertices: Array, corners: Indices, distance: float = 0.0) -> tuple[Array, Indices]:
    """The surface with one vertex (m, 3) for all that are at most a `distance` apart."""
    where, which = np.unique(vertices, axis=0, return_inverse=True)
    which = which.ravel()
    if distance > 0.0:
        pairs = cKDTree(where).query_pairs(distance, output_type="ndarray")
        group = np.empty(len(where), dtype=np.intp)
        groups = groups_of(len(where), pairs)
        for number, members in enumerate(groups):
            group[members] = number
        where, which = where[[members[0] for members in groups]], group[which]
    return where, which[corners]


def repaired(vertices: Array, corners: Indices, owners: Indices) -> tuple[Array, Indices, Indices]:
    """Vertices, triangles and the face of each, mended.

    Near vertices become one, repeated triangles and those without three corners go, holes are
    filled by triangles about their middle, and neighbours are made to run the same way round, with
    the body behind them.
    """
    size = float(np.ptp(vertices[corners].reshape(-1, 3), axis=0).max())
    vertices, corners = merged(vertices, corners, _CLOSE * size)
    kept = proper(corners)
    corners, owners = corners[kept], owners[kept]
    first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)[1]
    corners, owners = corners[np.sort(first)], owners[np.sort(first)]
    vertices, corners, owners = _filled(vertices, _alike(corners), owners)
    return vertices, _with_body_behind(vertices, corners), owners


def turned(vertices: Array, corners: Indices) -> Indices:
    """The triangles of a closed surface, all counterclockwise seen from outside."""
    return _with_body_behind(vertices, _alike(corners))


def _alike(corners: Indices) -> Indices:
    """The triangles, neighbours running the same way round."""
    return np.asarray(geometry_library("igl").bfs_orient(corners)[0], dtype=np.intp)


def proper(corners: Indices) -> Indices:
    """Which triangles have three different corners."""
    a, b, c = corners.T
    return np.flatnonzero((a != b) & (b != c) & (c != a))


def _filled(vertices: Array, corners: Indices, owners: Indices) -> tuple[Array, Indices, Indices]:
    """The surface with a fan of triangles in each hole, on the face beside its first edge."""
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    edges_there = zip(starts.tolist(), ends.tolist(), strict=True)
    beside = dict(zip(edges_there, np.repeat(owners, 3).tolist(), strict=True))
    for loop in geometry_library("igl").boundary_loop_all(corners):
        ring = np.array(loop, dtype=np.intp)
        edges = np.stack([ring, np.roll(ring, -1)], axis=1)
        if (int(edges[0, 0]), int(edges[0, 1])) in beside:
            edges = edges[:, ::-1]
        middle = vertices[ring].mean(axis=0)
        owner = beside.get((int(edges[0, 1]), int(edges[0, 0])), 0)
        if len(ring) == 3:
            fan = np.stack([edges[0, 0], edges[0, 1], np.setdiff1d(ring, edges[0])[0]])[None]
        else:
            fan = np.column_stack([edges, np.full(len(ring), len(vertices))])
            vertices = np.vstack([vertices, middle])
        corners = np.vstack([corners, fan])
        owners = np.concatenate([owners, np.full(len(fan), owner)])
    return vertices, corners, owners


def _with_body_behind(vertices: Array, corners: Indices) -> Indices:
    """Triangles of each closed part turned so that what they enclose, or surround, is the body."""
    corners = corners.copy()
    parts = pieces_of(corners)
    for part in parts:
        surface = Triangles(vertices, corners, ("all",), np.zeros(len(corners), dtype=np.intp))
        own = Triangles(vertices, corners[part], ("all",), np.zeros(len(part), dtype=np.intp))
        if own.moments(np.zeros(3)).volume < 0.0:
            corners[part] = corners[part][:, ::-1]
    for part in parts:
        surface = Triangles(vertices, corners, ("all",), np.zeros(len(corners), dtype=np.intp))
        # Every part encloses something now: within an odd number of others it is a hole. Against
        # another it has as much in front as behind.
        behind, ahead = sides(surface, part)
        if ahead % 2 == 1 and behind > ahead:
            corners[part] = corners[part][:, ::-1]
    return corners
