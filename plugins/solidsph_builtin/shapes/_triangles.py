"""Triangles: a closed surface of flat triangles, and what follows from it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Moments, Surface
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.shapes._libraries import geometry_library
from solidsph_builtin.shapes._sampling import ON_SURFACE

# Cosine of the angle between the way to the nearest place and the normal there.
_STRAIGHT_ABOVE = 1.0 - 1e-8

# Of the expansion of the winding number, and how far away a group must be for it: errors are below
# 0.01, and 0.5 would be a wrong side.
_ORDER, _ACCURACY = 2, 2.0

# Part of the size of the body by which an edge may bend inwards and still count as straight.
_STRAIGHT = 1e-12


@attrs.frozen(eq=False, slots=False)
class Triangles:
    """A closed surface whose triangles run counterclockwise, seen from outside."""

    vertices: Array  # (m, 3) [m]
    corners: Indices  # (k, 3) vertices of each triangle
    names: tuple[str, ...]  # of the faces
    owners: Indices  # (k,) the face that each triangle belongs to
    # For the last reach that was asked for, middles of pieces of the triangles, and their size [m].
    _middles: dict[float, tuple[cKDTree, float]] = attrs.field(factory=dict, init=False)

    @cached_property
    def areas(self) -> Array:
        """Area vectors, outward, (k, 3) [m^2]."""
        return area_vectors(self.vertices[self.corners])

    @cached_property
    def normals(self) -> Array:
        """Outward, (k, 3) [-]; zero for a triangle without area."""
        sizes = np.linalg.norm(self.areas, axis=1, keepdims=True)
        return self.areas / np.where(sizes > 0.0, sizes, 1.0)

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner of the box around it, each (3,) [m]."""
        used = self.vertices[self.corners].reshape(-1, 3)
        return used.min(axis=0), used.max(axis=0)

    def signed_distance(self, points: Array) -> Array:
        """Distance of `points` (n, 3) from the surface, (n,) [m]; negative inside.

        Straight above or below a triangle that tells the side; elsewhere, the winding number
        (Barill et al. 2018) does.
        """
        if not len(points):
            return np.zeros(0)
        triangles, feet = self._closest(points)
        ways = points - feet
        distance = np.sqrt(np.einsum("ni,ni->n", ways, ways))
        heights = np.einsum("ni,ni->n", ways, self.normals[triangles])
        beside = np.flatnonzero(np.abs(heights) <= _STRAIGHT_ABOVE * distance)
        if beside.size:
            inside = self.winding_numbers(points[beside]) > 0.5
            heights[beside] = np.where(inside, -1.0, 1.0)
        result: Array = np.copysign(distance, heights)
        return result

    def distance_within(self, points: Array, reach: float) -> Array:
        """The same, no further than `reach` [m] from 0: few triangles are near points near them."""
        if reach not in self._middles:
            pieces, _ = divided(self.vertices[self.corners], reach)
            middles = pieces.mean(axis=1)
            size = float(np.linalg.norm(pieces - middles[:, None], axis=2).max())
            self._middles.clear()
            self._middles[reach] = cKDTree(middles), size
        tree, size = self._middles[reach]
        near = np.isfinite(tree.query(points, distance_upper_bound=reach + size)[0])
        result = np.full(len(points), reach)
        result[near] = np.clip(self.signed_distance(points[near]), -reach, reach)
        far = np.flatnonzero(~near)
        result[far[self.winding_numbers(points[far]) > 0.5]] = -reach
        return result

    def nearest(self, points: Array) -> Array:
        """The places on the surface nearest to `points` (n, 3), (n, 3) [m]."""
        return self._closest(points)[1] if len(points) else points

    def winding_numbers(self, points: Array) -> Array:
        """How often the surface runs around each of `points` (n, 3), (n,)."""
        if not len(points):
            return np.zeros(0)
        result: Array = self._winding.winding_number(_rows(points), _ACCURACY)
        return result

    def moments(self, about: Array) -> Moments:
        """Moments of the body about a point (3,), exact up to rounding."""
        # Tetrahedra between the point and each triangle; the integral of x x^T over one with
        # corners a, b, c and 0 is V/20 (a a^T + b b^T + c c^T + s s^T), s = a + b + c.
        x = self.vertices[self.corners] - about
        volumes = np.einsum("ki,ki->k", x[:, 0], self.areas) / 3.0
        total = x.sum(axis=1)
        second = np.einsum("k,kci,kcj->ij", volumes, x, x)
        second += np.einsum("k,ki,kj->ij", volumes, total, total)
        return Moments(float(volumes.sum()), volumes @ total / 4.0, second / 20.0)

    def surface(self, spacing: float) -> Surface:
        """The middles of pieces of the triangles, no edge longer than half a `spacing` [m]."""
        pieces, owners = divided(self.vertices[self.corners], 2.0 / ON_SURFACE * spacing)
        areas = area_vectors(pieces)
        # A needle without any area has no direction.
        some = np.linalg.norm(areas, axis=1) > 0.0
        names = np.array(self.names, dtype=object)[self.owners[owners[some]]]
        return Surface(pieces[some].mean(axis=1), areas[some], tuple(names.tolist()))

    @cached_property
    def convex(self) -> bool:
        """True if it is in one piece and bends outwards along every edge."""
        edges, beside = edges_of(self.corners)
        if len(edges) * 2 != self.corners.size or len(pieces_of(self.corners)) > 1:
            return False
        first, second = beside.T
        middle = self.vertices[self.corners[second]] - self.vertices[edges[:, :1]]
        lower, upper = self.bounds()
        above = np.einsum("eci,ei->ec", middle, self.normals[first])
        return bool(above.max() <= _STRAIGHT * float((upper - lower).max()))

    def _closest(self, points: Array) -> tuple[Indices, Array]:
        """The triangle nearest to each of `points` (n, 3), and the nearest place on it, (n, 3)."""
        _, found, _ = self._tree.squared_distance(self.vertices, self.corners, _rows(points))
        # On long thin triangles the place that comes with it is off by 1e-9 of the size.
        triangles = np.asarray(found, dtype=np.intp)
        corners = self.vertices[self.corners[triangles]]
        normals = self.normals[triangles]
        heights = np.einsum("ni,ni->n", points - corners[:, 0], normals)
        feet = points - heights[:, None] * normals
        above = np.asarray(normals.any(axis=1))
        least = np.full(len(points), np.inf)
        on_edges = feet.copy()
        for k in range(3):
            edges = corners[:, (k + 1) % 3] - corners[:, k]
            offsets = points - corners[:, k]
            above &= np.einsum("ni,ni->n", np.cross(edges, offsets), normals) >= 0.0
            squares = np.einsum("ni,ni->n", edges, edges)
            along = np.einsum("ni,ni->n", edges, offsets) / np.where(squares > 0.0, squares, 1.0)
            there = corners[:, k] + np.clip(along, 0.0, 1.0)[:, None] * edges
            gaps = np.linalg.norm(points - there, axis=1)
            on_edges[gaps < least] = there[gaps < least]
            np.minimum(least, gaps, out=least)
        return triangles, np.where(above[:, None], feet, on_edges)

    @cached_property
    def _tree(self) -> Any:
        tree = geometry_library("igl").AABB()
        tree.init(self.vertices, self.corners)
        return tree

    @cached_property
    def _winding(self) -> Any:
        winding = geometry_library("igl").FastWindingNumberBVH()
        winding.init(self.vertices, self.corners, _ORDER)
        return winding


def _rows(points: Array) -> Array:
    return np.ascontiguousarray(points, dtype=np.float64)


def area_vectors(triangles: Array) -> Array:
    """Area vectors of `triangles` (k, 3, 3) [m], (k, 3) [m^2]."""
    a, b, c = triangles.transpose(1, 0, 2)
    return 0.5 * np.asarray(np.cross(b - a, c - a))


def divided(triangles: Array, longest: float) -> tuple[Array, Indices]:
    """`triangles` (k, 3, 3) in pieces without an edge above `longest` [m], and their owners.

    Each is cut in two through the middle of its longest edge, again and again.
    """
    owners = np.arange(len(triangles))
    done: list[tuple[Array, Indices]] = []
    while len(triangles):
        sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
        # Of equal ones the first, whatever rounding says.
        side = np.argmax(sides > sides.max(axis=1, keepdims=True) * (1.0 - 1e-9), axis=1)
        long = sides.max(axis=1) > longest
        done.append((triangles[~long], owners[~long]))
        order = (side[long, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(triangles[long], order[:, :, None], axis=1).transpose(1, 0, 2)
        middle = 0.5 * (a + b)
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        triangles, owners = np.concatenate(halves), np.tile(owners[long], 2)
    return np.concatenate([t for t, _ in done]), np.concatenate([o for _, o in done])


def edges_of(corners: Indices) -> tuple[Indices, Indices]:
    """Edges (e, 2) that two triangles share, and the two, (e, 2).

    Where four triangles meet in an edge, two and two of them.
    """
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    triangles = np.repeat(np.arange(len(corners)), 3)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    order = np.lexsort((starts > ends, high, low))
    low, high, triangles = low[order], high[order], triangles[order]
    # Runs of equal edges; the first half runs one way, the second the other.
    first = np.flatnonzero(np.r_[True, (np.diff(low) != 0) | (np.diff(high) != 0)])
    counts = np.diff(np.r_[first, len(low)])
    edges, beside = [], []
    for count in np.unique(counts[counts % 2 == 0]).tolist():
        runs = first[counts == count]
        for k in range(count // 2):
            edges.append(np.stack([low[runs], high[runs]], axis=1))
            beside.append(np.stack([triangles[runs + k], triangles[runs + k + count // 2]], axis=1))
    none = np.empty((0, 2), dtype=np.intp)
    return np.concatenate([none, *edges]), np.concatenate([none, *beside])


def pieces_of(corners: Indices) -> list[Indices]:
    """Triangles of each connected part of a surface, by the first of them."""
    return groups_of(len(corners), edges_of(corners)[1])


def groups_of(count: int, pairs: Indices) -> list[Indices]:
    """Numbers below `count` in groups that `pairs` (m, 2) connect, by the first of each."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    labels = connected_components(graph, directed=False)[1]
    _, first, group = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))[group]
    order = np.argsort(rank, kind="stable")
    return np.split(order, np.cumsum(np.bincount(rank))[:-1])
