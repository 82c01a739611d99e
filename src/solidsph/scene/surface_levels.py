"""Samples of a surface, ever coarser: what it looks like from further and further away."""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices

BEND = float(np.cos(np.radians(30.0)))
"""Cosine of the angle above which two neighbouring parts of a surface meet in an edge."""

# Distance of samples, in cubes, of a shape that makes no more than it must; others make many more.
_SAMPLES = 2.0
# Directions that round to the same multiples of this are alike.
_ALIKE = 0.5
# Samples whose neighbours are searched at once.
_AT_ONCE = 50_000


@final
@attrs.frozen(eq=False)
class Level:
    """Means of samples in cubes, of those with about the same direction."""

    size: float  # of the cubes [m]
    points: Array  # (m, d) [m]
    normals: Array  # (m, d) mean of the outward unit normals: shorter where the surface bends [-]
    areas: Array  # (m,) [m^(d-1)]

    @property
    def directions(self) -> Array:
        """Outward unit normals, (m, d) [-]."""
        return np.asarray(self.normals / np.linalg.norm(self.normals, axis=1, keepdims=True))

    def coarser(self, size: float) -> tuple[Level, Indices]:
        """The means in cubes of another `size` [m], and which of them each of these is in, (m,)."""
        places = np.floor((self.points - self.points.min(axis=0)) / size).astype(np.int64)
        ways = np.rint(self.directions / _ALIKE).astype(np.int64)
        keys = np.column_stack([places, ways - ways.min(axis=0)])
        _, parents = np.unique(
            np.ravel_multi_index(tuple(keys.T), tuple((keys.max(axis=0) + 1).tolist())),
            return_inverse=True,
        )
        areas = np.asarray(np.bincount(parents, self.areas), dtype=np.float64)
        means = [
            np.bincount(parents, self.areas * x) / areas
            for x in np.column_stack([self.points, self.normals]).T
        ]
        points, normals = np.split(np.stack(means, axis=1), 2, axis=1)
        return Level(size, points, normals, areas), parents

    def near(self, reach: float) -> Iterator[tuple[Indices, Indices]]:
        """Pairs of samples closer than `reach` [m], each with itself and both ways round, in parts
        that have all pairs of their first samples."""
        tree = cKDTree(self.points)
        for rows in np.array_split(tree.indices, 1 + len(self.points) // _AT_ONCE):
            own = cKDTree(self.points[rows])
            found = own.sparse_distance_matrix(tree, reach, output_type="ndarray")
            yield rows[found["i"]], found["j"]


def first_level(shape: Shape, size: float) -> Level:
    """The surface of a shape in cubes of a `size` [m]."""
    surface = shape.surface(_SAMPLES * size)
    areas = np.linalg.norm(surface.area_vectors, axis=1)
    some = areas > 0.0
    normals = surface.area_vectors[some] / areas[some, None]
    return Level(0.0, surface.points[some], normals, areas[some]).coarser(size)[0]
