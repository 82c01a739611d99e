"""Thickness of a body, by rays through it that leave where its surface faces the other way.

A ray that starts beside a corner leaves through the other side of that corner, and its length shows
only how near the corner is. So a ray counts only where the two sides are nearly parallel and do not
meet in a corner ahead: as those of a plate, a web, or a beam that tapers to a blunt end.
"""

from __future__ import annotations

from math import cos, radians

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask

_RAYS = {2: 2000, 3: 600}  # by dimension: many find a narrow web, and cost time
_MARCHES = 200

# Largest angle between the two sides of a thin part; below the second they meet too far away.
_TAPERING, _PARALLEL = cos(radians(30.0)), cos(radians(1.0))

# Share of the surface of thin parts: rays beside rims and cut edges find less than there is.
_STRAY = 0.03

# Share of the rays: a body with fewer of them has no thin part, only corners.
_FEW = 0.01

# Directions between the two sides of a notch, and places along notches.
_NOTCHED = 500
_TURNS = np.linspace(0.0, 1.0, 9)[1:-1]


@attrs.frozen(eq=False)
class Rays:
    """Straight lines through a body, each from a place of its surface along the normal there."""

    starts: Array  # (k, d) [m]
    lengths: Array  # (k,) [m]
    areas: Array  # (k,) area of the surface that each represents [m^(d-1)]
    facing: Array  # (k,) cosine of the angle between the two sides [-]
    corner: Mask  # (k,) whether the two sides meet in a corner

    def least(self, widest: float) -> float:
        """Thickness of the thinnest part [m].

        Args:
            widest: diameter of the largest ball inside [m], for a body that has corners only.
        """
        thin = (self.facing >= _TAPERING) & ~self.corner
        if thin.mean() > _FEW:
            parallel = self.lengths[thin & (self.facing >= _PARALLEL)]
            most = _below(self.lengths[thin], self.areas[thin], _STRAY)
            return float(min(parallel.min(initial=np.inf), most))
        blade = (self.facing >= _TAPERING) & self.corner  # as thick as its middle
        return min(widest, _below(self.lengths[blade], self.areas[blade], 0.5) or widest)

    def usual(self, widest: float) -> float:
        """Thickness that half of the surface exceeds [m]."""
        return _below(self.lengths, self.areas, 0.5) or widest


def _below(lengths: Array, areas: Array, part: float) -> float:
    """Length that rays of this share of the area stay below [m]; 0 without any area."""
    if not areas.sum() > 0.0:
        return 0.0
    order = np.argsort(lengths)
    shares = np.cumsum(areas[order]) / areas.sum()
    last = order[min(int(np.searchsorted(shares, part)), len(order) - 1)]
    return float(lengths[last])


@attrs.frozen(eq=False)
class SampledSurface:
    """Samples of a surface, and how to find the nearest."""

    points: Array  # (m, d) [m]
    inward: Array  # (m, d) unit normals
    areas: Array  # (m,) [m^(d-1)]
    tree: cKDTree
    step: float  # between samples [m]

    def heights(self, points: Array) -> tuple[Array, Array]:
        """Distance to the nearest sample, and height above the surface there, each (k,) [m]."""
        gaps, near = self.nearest(points, 1)
        return gaps[:, 0], np.einsum(
            "ki,ki->k", points - self.points[near[:, 0]], self.inward[near[:, 0]]
        )

    def nearest(self, points: Array, count: int) -> tuple[Array, Indices]:
        """Distances to the nearest samples [m] and their numbers, each (k, count)."""
        wanted = np.arange(1, min(count, len(self.points)) + 1)
        gaps, near = self.tree.query(points, wanted)
        return np.asarray(gaps), np.asarray(near, dtype=np.intp)


def rays_through(shape: Shape, spacing: float) -> Rays:
    """Rays through `shape`, whose surface is sampled for this spacing [m]."""
    surface = _boundary(shape, spacing)
    count = len(surface.points)
    chosen = np.linspace(0, count - 1, min(count, _RAYS[shape.dimension])).astype(np.intp)
    tips, between = _notches(surface)
    starts = np.concatenate([surface.points[chosen], tips])
    directions = np.concatenate([surface.inward[chosen], between])
    areas = np.concatenate([surface.areas[chosen], np.zeros(len(tips))])
    lengths, ended = _lengths(surface, starts, directions, spacing)
    starts, directions, lengths = starts[ended], directions[ended], lengths[ended]
    normals = _normals(surface, starts + lengths[:, None] * directions)
    facing = -np.einsum("ki,ki->k", normals, directions)
    corner = _meet(surface, starts, directions, lengths, normals)
    return Rays(starts, lengths, areas[ended], facing, corner)


def _boundary(shape: Shape, spacing: float) -> SampledSurface:
    surface = shape.surface(spacing)
    sizes = np.linalg.norm(surface.area_vectors, axis=1)
    owned = sizes > 0.0
    points, sizes = surface.points[owned], sizes[owned]
    inward = -surface.area_vectors[owned] / sizes[:, None]
    step = float(np.median(sizes) ** (1.0 / (shape.dimension - 1)))
    return SampledSurface(points, inward, sizes, cKDTree(points), step)


def _lengths(
    surface: SampledSurface, starts: Array, directions: Array, spacing: float
) -> tuple[Array, Mask]:
    """Length of each ray inside (k,) [m], and whether it left within the steps made."""
    # No ray begins at an edge, along which it would run: a third of a spacing to the middle.
    begin, least = 0.05 * spacing, 0.25 * spacing
    lengths = np.full(len(starts), begin)
    inside = np.arange(len(starts))
    for _ in range(_MARCHES):
        gaps, heights = surface.heights(starts[inside] + lengths[inside, None] * directions[inside])
        out = heights < 0.0
        lengths[inside[out]] += heights[out]  # back to the surface
        inside, gaps = inside[~out], gaps[~out]
        if not len(inside):
            break
        free = np.sqrt(np.maximum(gaps**2 - 0.5 * surface.step**2, 0.0))  # between samples
        lengths[inside] += np.maximum(free, least)
    ended = lengths > 2.0 * begin  # others start at an edge, where the normal is not inward
    ended[inside] = False
    return lengths, ended


def _normals(surface: SampledSurface, ends: Array) -> Array:
    """Inward normals where rays leave, (k, d); at the tip of a notch the mean of its sides."""
    gaps, near = surface.nearest(ends, 8)
    weights = (gaps <= gaps[:, :1] + 1.5 * surface.step).astype(np.float64)
    normals = np.einsum("km,kmi->ki", weights, surface.inward[near])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(sizes, 1e-12))


def _meet(
    surface: SampledSurface, starts: Array, directions: Array, lengths: Array, normals: Array
) -> Mask:
    """True if the planes through both ends of a ray meet where the surface is, (k,)."""
    facing = np.einsum("ki,ki->k", normals, directions)
    along = normals - facing[:, None] * directions
    slope = np.linalg.norm(along, axis=1)  # the sine of the angle between the planes
    away = lengths * facing / np.maximum(slope, 1e-12) ** 2
    apexes = starts + np.where(slope > 1e-6, away, 0.0)[:, None] * along
    gaps, _ = surface.heights(apexes)
    return np.asarray((-facing < _PARALLEL) & (gaps < 0.1 * lengths + surface.step))


def _notches(surface: SampledSurface) -> tuple[Array, Array]:
    """Rays from the tips of notches, between the normals of their sides, each (k, d)."""
    points, inward = surface.points, surface.inward
    pairs = surface.tree.query_pairs(1.5 * surface.step, output_type="ndarray")
    a, b = pairs[:, 0], pairs[:, 1]
    turned = np.einsum("ki,ki->k", inward[a], inward[b]) < _TAPERING
    behind = np.einsum("ki,ki->k", points[b] - points[a], inward[a]) < -1e-6 * surface.step
    a, b = a[turned & behind][:_NOTCHED], b[turned & behind][:_NOTCHED]
    blend = (1.0 - _TURNS)[:, None, None] * inward[a] + _TURNS[:, None, None] * inward[b]
    directions = blend.reshape(-1, points.shape[1])
    tips = np.tile(0.5 * (points[a] + points[b]), (len(_TURNS), 1))
    sizes = np.linalg.norm(directions, axis=1)
    kept = sizes > 0.1
    return tips[kept], directions[kept] / sizes[kept, None]
