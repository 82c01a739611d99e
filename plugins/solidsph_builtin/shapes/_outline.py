"""Outlines of many straight edges: the edge nearest to a point, and edges that cross."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Moments
from solidsph.maths.arrays import Array, Indices

# Pairs of a point and an edge, or of two edges, that are processed together.
_AT_ONCE = 1 << 20


@attrs.frozen(eq=False)
class ClosedLines:
    """Closed lines of straight edges, with the body on their left, searched by a tree of short
    pieces of them."""

    starts: Array  # (m, d=2) where each edge starts [m]
    edges: Array  # (m, 2) from there to where the next one starts [m]
    following: Indices  # (m,) the next edge
    preceding: Indices  # (m,) the one before
    normals: Array  # (m, 2) outward [-]
    tree: cKDTree  # of the middles of the pieces
    owners: Indices  # (p,) the edge of each piece
    reach: float  # half the length of the longest piece [m]

    @classmethod
    def of(cls, rings: Sequence[Array]) -> ClosedLines:
        """The lines through the corners (m, 2) of each ring, joined to the next, the last to the
        first."""
        starts = np.concatenate(rings)
        following = next_of(rings)
        edges = starts[following] - starts
        lengths = np.hypot(*edges.T)
        # Pieces no longer than an edge is on average: there are at most twice as many.
        counts = np.ceil(lengths / lengths.mean()).astype(np.intp)
        owners, middles = pieces(starts, edges, counts)
        right = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / lengths[:, np.newaxis]
        return cls(
            starts=starts,
            edges=edges,
            following=following,
            preceding=np.argsort(following),
            normals=right,
            tree=cKDTree(middles),
            owners=owners,
            reach=0.5 * float((lengths / counts).max()),
        )

    def signed_distance(self, points: Array) -> Array:
        """Distance of `points` (n, 2) from the line, (n,) [m]; negative inside."""
        distance = np.empty(len(points))
        for rows, near in self._nearest(points):
            distance[rows] = self._signed(points[rows], near)
        return distance

    def nearest(self, points: Array) -> Array:
        """The places on the lines nearest to `points` (n, 2), (n, 2) [m]."""
        feet = np.empty_like(points)
        for rows, near in self._nearest(points):
            feet[rows] = points[rows] - self._offsets(points[rows], near)[0]
        return feet

    def moments(self, about: Array) -> Moments:
        """Moments of what is enclosed about a point (2,), exact up to rounding."""
        # Triangles between the point and each edge; the integral of x x^T over one with corners
        # a, b and 0 is A/12 (a a^T + b b^T + s s^T), s = a + b.
        a = self.starts - about
        b = a + self.edges
        areas = 0.5 * _cross(a, b)
        total = a + b
        second = sum(np.einsum("m,mi,mj->ij", areas, x, x) for x in (a, b, total))
        return Moments(float(areas.sum()), areas @ total / 3.0, np.asarray(second) / 12.0)

    def _nearest(self, points: Array) -> Iterator[tuple[Indices, Indices]]:
        """Indices of some of the points, and the edge nearest to each."""
        remaining, count = np.arange(len(points)), 4
        while remaining.size:
            count = min(count, len(self.owners))
            again = []
            for rows in np.array_split(remaining, 1 + remaining.size * count // _AT_ONCE):
                answer = self.tree.query(points[rows], k=np.arange(1, count + 1))
                gaps, pieces = map(np.asarray, answer)
                edges = self.owners[pieces]
                squares = _squared(self._offsets(points[rows, np.newaxis], edges)[0])
                best = np.argmin(squares, axis=1)
                nearest = np.take_along_axis(squares, best[:, np.newaxis], axis=1)[:, 0]
                # No piece beyond those found can be nearer.
                near = gaps[:, -1] - self.reach > np.sqrt(nearest)
                near |= count == len(self.owners)
                yield rows[near], edges[near, best[near]]
                again.append(rows[~near])
            remaining, count = np.concatenate(again), 8 * count

    def _offsets(self, points: Array, edges: Indices) -> tuple[Array, Array]:
        """Offsets (..., 2) from the nearest place on each edge to the point, and that place as a
        fraction of the edge."""
        edge, offset = self.edges[edges], points - self.starts[edges]
        along = np.clip(np.sum(offset * edge, axis=-1) / _squared(edge), 0.0, 1.0)
        return offset - along[..., np.newaxis] * edge, along

    def _signed(self, points: Array, edges: Indices) -> Array:
        gaps, along = self._offsets(points, edges)
        # At a corner the sum of the normals of both edges decides the side (Baerentzen & Aanaes
        # 2005, in the plane).
        normals = self.normals[edges]
        for end, other in ((0.0, self.preceding), (1.0, self.following)):
            at = along == end
            normals[at] += self.normals[other[edges[at]]]
        outside = np.sum(gaps * normals, axis=1) >= 0.0
        distance = np.sqrt(_squared(gaps))
        return np.where(outside, distance, -distance)


def next_of(rings: Sequence[Array]) -> Indices:
    """The corner behind each one along its ring, (m,), of rings of corners (k, 2)."""
    ends = np.cumsum([len(ring) for ring in rings])
    following = np.arange(1, int(ends[-1]) + 1)
    following[ends - 1] = np.concatenate([[0], ends[:-1]])
    return following


def pieces(starts: Array, edges: Array, counts: Indices) -> tuple[Indices, Array]:
    """Edge (p,) and middle (p, 2) of each piece of edges in `counts` (m,) equal pieces."""
    owners = np.repeat(np.arange(len(starts)), counts)
    within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    along = (within + 0.5) / counts[owners]
    return owners, starts[owners] + along[:, np.newaxis] * edges[owners]


def first_crossing(starts: Array, following: Indices) -> tuple[int, int] | None:
    """Two edges that share a point other than the vertex between neighbours, or None.

    Of pairs found together these are the lowest; the search ends with them.

    Args:
        starts: where each edge starts, (m, 2).
        following: the edge behind each, (m,).
    """
    ends = starts[following]
    edges = ends - starts
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    for first, second in _overlapping(low, high):
        i, j = np.minimum(first, second), np.maximum(first, second)
        # Two segments meet where their boxes overlap and each has its ends on both sides of the
        # other, or on it.
        near = ((low[j] <= high[i]) & (high[j] >= low[i])).all(axis=1)
        i, j = i[near], j[near]
        meets = np.ones(len(i), dtype=np.bool_)
        for a, b in ((i, j), (j, i)):
            before = _cross(edges[a], starts[b] - starts[a])
            after = _cross(edges[a], ends[b] - starts[a])
            meets &= before * after <= 0.0
        # Neighbours always meet at their vertex; they only must not fold back onto each other.
        neighbours = (following[i] == j) | (following[j] == i)
        folded = _cross(edges[i], edges[j]) == 0.0
        folded &= np.sum(edges[i] * edges[j], axis=1) < 0.0
        meets = np.where(neighbours, folded, meets)
        if meets.any():
            return min(zip(i[meets].tolist(), j[meets].tolist(), strict=True))
    return None


def _overlapping(low: Array, high: Array) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of boxes that overlap along the axis on which fewer do, some at a time."""
    candidates = []
    for axis in range(low.shape[1]):
        order = np.argsort(low[:, axis], kind="stable")
        last = np.searchsorted(low[order, axis], high[order, axis], side="right")
        candidates.append((order, last - np.arange(1, len(order) + 1)))
    order, counts = min(candidates, key=lambda pair: int(pair[1].sum()))
    bounds = np.cumsum(counts)
    begin = 0
    while begin < len(order):
        done = bounds[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(bounds, done + _AT_ONCE, side="right")))
        some = np.arange(begin, end)
        first = np.repeat(some, counts[some])
        within = np.arange(len(first)) - np.repeat(bounds[some] - counts[some] - done, counts[some])
        yield order[first], order[first + 1 + within]
        begin = end


def _squared(vectors: Array) -> Array:
    result: Array = np.sum(vectors * vectors, axis=-1)
    return result


def _cross(a: Array, b: Array) -> Array:
    product: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
