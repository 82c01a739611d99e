"""Closest places on triangles, found in a tree of boxes around them by compiled loops."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed.partition import thread_count
from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Indices

# Triangles in a box of the last level.
_IN_LEAF = 4
# Points that follow each other and start from the triangle found last; each of these blocks starts
# anew, so that results do not depend on the number of threads.
_BLOCK = 256
# Nanoseconds that a point takes, roughly.
_PER_POINT = 1000


class Tree(NamedTuple):
    """Boxes around boxes: those of box i are 2 i and 2 i + 1; box 1 is around all."""

    lower: Array  # (2 leaves, 3) [m]
    upper: Array  # (2 leaves, 3) [m]
    order: Indices  # (leaves _IN_LEAF,) triangles, those of each leaf side by side
    corners: Array  # (k, 3, 3) of the triangles [m]
    normals: Array  # (k, 3) [-], zero for a triangle without area


def tree_of(corners: Array, normals: Array) -> Tree:
    """The tree of triangles (k, 3, 3) [m]: each box is halved across its longest side."""
    leaves = 1
    while leaves * _IN_LEAF < len(corners):
        leaves *= 2
    # Full leaves, with some triangles twice.
    order = np.arange(leaves * _IN_LEAF) * len(corners) // (leaves * _IN_LEAF)
    middles, boxes = corners.mean(axis=1), 1
    while boxes < leaves:
        inside = middles[order].reshape(boxes, -1, 3)
        longest = np.argmax(np.ptp(inside, axis=1), axis=1)
        along = np.take_along_axis(inside, longest[:, None, None], axis=2)[:, :, 0]
        places = np.argsort(along, axis=1, kind="stable")
        order = np.take_along_axis(order.reshape(boxes, -1), places, axis=1).ravel()
        boxes *= 2
    lower, upper = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    lower[leaves:] = corners[order].min(axis=1).reshape(leaves, -1, 3).min(axis=1)
    upper[leaves:] = corners[order].max(axis=1).reshape(leaves, -1, 3).max(axis=1)
    while boxes > 1:
        pairs = slice(boxes, 2 * boxes)
        boxes //= 2
        lower[boxes : 2 * boxes] = lower[pairs].reshape(-1, 2, 3).min(axis=1)
        upper[boxes : 2 * boxes] = upper[pairs].reshape(-1, 2, 3).max(axis=1)
    return Tree(lower, upper, order, np.ascontiguousarray(corners), np.ascontiguousarray(normals))


def closest(tree: Tree, points: Array, reach: float) -> tuple[Indices, Array]:
    """The triangle nearest to each of `points` (n, 3), (n,), and the nearest place on it, (n, 3).

    Of a point further than `reach` [m] from all triangles they are -1 and the point itself.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    triangles, feet = np.empty(len(points), dtype=np.intp), points.copy()
    search = _search(thread_count(_PER_POINT * len(points)) > 1)
    search(*tree, points, reach, triangles, feet)
    return triangles, feet


@cache
def _search(threaded: bool) -> Any:
    """Compiled (*tree, points (n, 3), reach, triangles (n,), feet (n, 3)), which fills the last
    two."""

    @njit
    def squared_to_box(lower, upper, node, x, y, z):
        a = max(lower[node, 0] - x, 0.0, x - upper[node, 0])
        b = max(lower[node, 1] - y, 0.0, y - upper[node, 1])
        c = max(lower[node, 2] - z, 0.0, z - upper[node, 2])
        return a * a + b * b + c * c

    # Straight below the point by the normal, else on the nearest of the three edges.
    @njit
    def foot_on(corners, normals, t, x, y, z):
        nx, ny, nz = normals[t, 0], normals[t, 1], normals[t, 2]
        above = nx != 0.0 or ny != 0.0 or nz != 0.0
        least = np.inf
        fx, fy, fz = x, y, z
        for k in range(3):
            m = (k + 1) % 3
            ax, ay, az = corners[t, k, 0], corners[t, k, 1], corners[t, k, 2]
            ex, ey, ez = corners[t, m, 0] - ax, corners[t, m, 1] - ay, corners[t, m, 2] - az
            ox, oy, oz = x - ax, y - ay, z - az
            side = nx * (ey * oz - ez * oy) + ny * (ez * ox - ex * oz) + nz * (ex * oy - ey * ox)
            above = above and side >= 0.0
            square = ex * ex + ey * ey + ez * ez
            along = (ex * ox + ey * oy + ez * oz) / (square if square > 0.0 else 1.0)
            along = min(max(along, 0.0), 1.0)
            px, py, pz = ax + along * ex, ay + along * ey, az + along * ez
            gap = (x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2
            if gap < least:
                least, fx, fy, fz = gap, px, py, pz
        if above:
            height = (
                (x - corners[t, 0, 0]) * nx
                + (y - corners[t, 0, 1]) * ny
                + (z - corners[t, 0, 2]) * nz
            )
            return height * height, x - height * nx, y - height * ny, z - height * nz
        return least, fx, fy, fz

    @njit(parallel=threaded)
    def search(lower, upper, order, corners, normals, points, reach, triangles, feet):
        n, leaves = len(points), len(lower) // 2
        for block in prange((n + _BLOCK - 1) // _BLOCK):
            nodes, gaps = np.empty(64, np.int64), np.empty(64)
            last = -1
            for p in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                x, y, z = points[p, 0], points[p, 1], points[p, 2]
                best, found = reach * reach, -1
                fx, fy, fz = x, y, z
                if last >= 0:
                    gap, gx, gy, gz = foot_on(corners, normals, last, x, y, z)
                    if gap <= best:
                        best, found, fx, fy, fz = gap, last, gx, gy, gz
                nodes[0], gaps[0], size = 1, squared_to_box(lower, upper, 1, x, y, z), 1
                while size > 0:
                    size -= 1
                    node = nodes[size]
                    if not gaps[size] < best:
                        continue
                    if node < leaves:
                        first, second = 2 * node, 2 * node + 1
                        one = squared_to_box(lower, upper, first, x, y, z)
                        two = squared_to_box(lower, upper, second, x, y, z)
                        if one < two:
                            first, second, one, two = second, first, two, one
                        nodes[size], gaps[size] = first, one
                        nodes[size + 1], gaps[size + 1] = second, two
                        size += 2
                        continue
                    for place in range((node - leaves) * _IN_LEAF, (node - leaves + 1) * _IN_LEAF):
                        t = order[place]
                        if t != last:
                            gap, gx, gy, gz = foot_on(corners, normals, t, x, y, z)
                            if gap < best:
                                best, found, fx, fy, fz = gap, t, gx, gy, gz
                last = found
                triangles[p] = found
                feet[p, 0], feet[p, 1], feet[p, 2] = fx, fy, fz

    return search
