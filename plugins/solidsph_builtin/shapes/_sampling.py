"""Samples of boundaries.

A lattice and the flat faces that bound it have the same number of cells along a length, and each
cell an even number of samples, centred. So on a face aligned with a lattice no sample is as near
to one particle as to another, whether these are at the centres of the cells or at their corners.
"""

from __future__ import annotations

import math
from itertools import chain, repeat
from typing import TypeAlias

import numpy as np

from solidsph.interfaces.shape import Surface
from solidsph.maths.arrays import Array

# Samples per spacing along a line, and along each direction of a surface in space. Both are even.
ON_LINE = 16
ON_SURFACE = 4

Piece: TypeAlias = tuple[str, Array, Array]  # a face, its points (m, d), its area vectors (m, d)


def cells_along(length: float, spacing: float) -> int:
    """Number of cells of about `spacing` [m] that fill `length` [m] best, at least 1."""
    # Slightly upwards, so that lengths that differ by rounding only are rounded alike.
    return max(1, math.floor(length / spacing + 0.5 + 1e-9))


def samples_along(length: float, spacing: float, per_cell: int) -> int:
    """Number of samples along `length` [m], `per_cell` for each cell of about `spacing` [m]."""
    return per_cell * cells_along(length, spacing)


def midpoints(length: float, spacing: float, per_cell: int) -> Array:
    """Centres of equal intervals that fill 0 to `length` [m], `per_cell` to each cell, (m,) [m]."""
    count = samples_along(length, spacing, per_cell)
    return np.arange(0.5, count) * (length / count)


def angles(radius: float, spacing: float, per_cell: int) -> Array:
    """Centres of equal arcs that fill a circle, (m,) [rad].

    Their number is a multiple of 8: sines and cosines then cancel in pairs to rounding, and no
    sample lies on an axis or a diagonal, where two particles of a lattice may be equally near.
    """
    count = 8 * math.ceil(2.0 * math.pi * radius * per_cell / (8.0 * spacing))
    return np.arange(0.5, count) * (2.0 * math.pi / count)


def circle(radius: float, spacing: float, per_cell: int) -> tuple[Array, Array]:
    """Outward unit normals of a circle (m, 2) [-] and the arc length of each sample (m,) [m]."""
    angle = angles(radius, spacing, per_cell)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return normals, np.full(angle.size, 2.0 * math.pi * radius / angle.size)


def disc(radius: float, spacing: float) -> tuple[Array, Array]:
    """Points of a flat disc about 0 (m, 2) [m] and the area of each (m,) [m^2].

    A square grid cut by the rim, which matches the lattice of the disc's bounding box.
    """
    along = midpoints(2.0 * radius, spacing, ON_SURFACE) - radius
    width = 2.0 * radius / along.size
    x, y = np.meshgrid(along, along, indexing="ij")
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    distance = np.hypot(points[:, 0], points[:, 1])
    # The part of a square inside a straight rim; cut squares are scaled to the exact area.
    shares = np.clip(0.5 - (distance - radius) / width, 0.0, 1.0)
    kept = shares > 0.0
    points, distance, areas = points[kept], distance[kept], shares[kept] * width**2
    whole = shares[kept] == 1.0
    areas[~whole] *= (math.pi * radius**2 - areas[whole].sum()) / areas[~whole].sum()
    points *= np.minimum(1.0, radius / np.maximum(distance, width))[:, np.newaxis]
    return points, areas


def sphere(radius: float, spacing: float) -> tuple[Array, Array]:
    """Outward unit normals of a sphere (m, 3) [-] and the area of each sample (m,) [m^2].

    The six faces of a cube, each in squares of equal angles, are projected from the centre. The
    set has every symmetry of the cube, and so have the areas of the particles of a lattice.
    """
    count = 2 * math.ceil(math.pi * radius * ON_SURFACE / (4.0 * spacing))
    edges = np.tan(np.linspace(-math.pi / 4.0, math.pi / 4.0, count + 1))
    u, v = np.meshgrid(edges, edges, indexing="ij")
    # Solid angle of the rectangle from (0, 0) to (u, v) on the plane at distance 1.
    corner = np.arctan(u * v / np.sqrt(1.0 + u**2 + v**2))
    solid = np.diff(np.diff(corner, axis=0), axis=1).ravel()
    centres = np.tan(np.arange(0.5, count) * (math.pi / (2.0 * count)) - math.pi / 4.0)
    x, y = np.meshgrid(centres, centres, indexing="ij")
    face = np.stack([np.ones(x.size), x.ravel(), y.ravel()], axis=1)
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    # A reflection serves as a rotation here: the grid of a face is its own mirror image.
    half = np.concatenate([np.roll(face, axis, axis=1) for axis in range(3)])
    return np.concatenate([half, -half]), radius**2 * np.tile(solid, 6)


def joined(pieces: list[Piece]) -> Surface:
    """One surface made of named pieces."""
    return Surface(
        points=np.concatenate([points for _, points, _ in pieces]),
        area_vectors=np.concatenate([area_vectors for _, _, area_vectors in pieces]),
        faces=tuple(chain.from_iterable(repeat(name, len(points)) for name, points, _ in pieces)),
    )


def unit(vectors: Array) -> Array:
    """Directions of `vectors` (m, d), (m, d) [-]."""
    result: Array = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return result
