"""Triangles: a closed surface of flat triangles, and what follows from it."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from solidsph.interfaces.shape import Moments, Surface
from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.shapes._libraries import geometry_library
from solidsph_builtin.shapes._sampling import ON_SURFACE

if TYPE_CHECKING:
    from solidsph_builtin.shapes._triangle_tree import Tree

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
        return self.distance_within(points, np.inf)

    def distance_within(self, points: Array, reach: float) -> Array:
        """The same, no further than `reach` [m] from 0: few triangles are near points near them."""
        if not len(points):
            return np.zeros(0)
        triangles, feet = self._closest(points, reach)
        ways = points - feet
        distance = np.sqrt(np.einsum("ni,ni->n", ways, ways))
        heights = np.einsum("ni,ni->n", ways, self.normals[triangles])
        far = triangles < 0
        distance[far], heights[far] = reach, 0.0
        beside = np.abs(heights) <= _STRAIGHT_ABOVE * distance
        # The surface is not between two far points that are less than the reach apart.
        follows = far & np.roll(far, 1)
        follows[0] = False
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        follows[1:] &= steps < reach
        asked = np.flatnonzero(beside & ~follows)
        sides = np.zeros(len(points))
        sides[asked] = np.where(self.winding_numbers(points[asked]) > 0.5, -1.0, 1.0)
        last = np.maximum.accumulate(np.where(follows, 0, np.arange(len(points))))
        heights = np.where(beside, sides[last], heights)
        result: Array = np.copysign(distance, heights)
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

    def _closest(self, points: Array, reach: float = np.inf) -> tuple[Indices, Array]:
        """The triangle nearest to each of `points` (n, 3), and the nearest place on it, (n, 3);
        none, -1, beyond a `reach` [m]."""
        from solidsph_builtin.shapes._triangle_tree import closest  # loads the compiler

        return closest(self._tree, points, reach)

    @cached_property
    def _tree(self) -> Tree:
        from solidsph_builtin.shapes._triangle_tree import tree_of

        return tree_of(self.vertices[self.corners], self.normals)

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
