"""Feet: the places on a boundary that points near it move to."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array

# Steps along the gradient of the distance, which halve the distance at the sharpest of corners.
_STEPS = 40

# Further from the boundary than this, in spacings, a point has not got there.
_AT = 1e-9


def on_boundary(shape: Shape, surface: Surface, points: Array, spacing: float) -> Array:
    """`points` (m, d) close to the boundary, moved to the nearest places on it, or along the
    gradient of the distance where these are not known [m].

    Args:
        surface: samples of the boundary, the last resort where the gradient leads nowhere.
        spacing: of the particles [m].
    """
    found = shape.nearest(points)
    if found is not None:
        return found
    d, tolerance = points.shape[1], 1e-14 * spacing
    points = points.copy()
    for _ in range(_STEPS):
        distance = shape.signed_distance(points)
        off = np.flatnonzero(np.abs(distance) > tolerance)
        if not off.size:
            return points
        # So small a step that beside an edge it stays on the side of one face.
        step = np.maximum(1e-3 * np.abs(distance[off]), 1e-9 * spacing)[:, None]
        slope = np.stack(
            [
                shape.signed_distance(points[off] + step * axis)
                - shape.signed_distance(points[off] - step * axis)
                for axis in np.eye(d)
            ],
            axis=1,
        )
        length = np.linalg.norm(slope, axis=1, keepdims=True)
        points[off] -= distance[off, None] * slope / np.where(length > 0.0, length, 1.0)
    distance = shape.signed_distance(points)
    lost = np.abs(distance) > _AT * spacing
    if lost.any():
        points[lost] = surface.points[cKDTree(surface.points).query(points[lost])[1]]
    return points
