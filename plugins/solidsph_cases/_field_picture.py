"""A field over a deformed plane body, as the pictures of several cases show it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import TriMesh
from matplotlib.tri import Triangulation
from scipy.spatial import Delaunay

from solidsph.maths.arrays import Array, Indices
from solidsph.results.record import Record

# Neighbours in a lattice are up to its diagonal apart; a longer edge spans a hole.
_LONGEST_EDGE = 1.9  # spacings


def show_field(axes: Axes, record: Record, step: int, values: Array) -> TriMesh:
    """Colour the body of `step` by `values` (n,), smoothly between particles; gives the mesh."""
    x, y = record.positions[step].T
    mesh = Triangulation(x, y, triangles(record))
    return axes.tripcolor(mesh, values, shading="gouraud", cmap="cividis")


def triangles(record: Record) -> Indices:
    """Triangles between neighbouring particles, (m, 3), from the reference configuration."""
    particles = record.particles
    found = np.asarray(Delaunay(particles.positions).simplices, dtype=np.intp)
    corners = particles.positions[found]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    short = edges.max(axis=1) < _LONGEST_EDGE * float(particles.spacings.max())
    # Between particles that all lie on a curved boundary there is none of the body.
    surface = particles.tags["surface"][found].all(axis=1)
    doubled_areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    thin = doubled_areas < 0.1 * float(particles.spacings.min()) ** 2
    kept: Indices = found[short & ~(surface & thin)]
    return kept
