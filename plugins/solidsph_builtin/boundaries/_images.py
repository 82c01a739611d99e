"""Interpolation: values at given points as linear combinations of those of the particles."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph.model.particles import Particles

# A point this close to a particle, in spacings, is that particle.
_SAME = 1e-6

# Neighbours of a linear fit, by dimension: about the nearest two shells of a lattice.
_FIT_NEIGHBOURS = {1: 3, 2: 9, 3: 20}


def interpolation(particles: Particles, points: Array) -> csr_array:
    """Matrix (k, n) that gives values at `points` (k, d) from those of the real particles.

    At a particle the value of that particle; elsewhere the weighted least squares fit of a linear
    field through the nearest particles, which is exact for a linear field.
    """
    real = np.flatnonzero(~particles.ghosts)
    d = particles.dimension
    tree = cKDTree(particles.positions[real])
    count = min(_FIT_NEIGHBOURS[d], len(real))
    # A list of ranks, not a count: the result then has a column for each rank, even for one.
    answer = tree.query(points, k=[*range(1, count + 1)])
    distances, nearest = np.asarray(answer[0]), np.asarray(answer[1])
    rows: list[Indices] = []
    columns: list[Indices] = []
    weights: list[Array] = []
    for k, point in enumerate(points):
        own = real[nearest[k]]
        spacing = particles.spacings[own[0]]
        if distances[k, 0] < _SAME * spacing:
            own, row = own[:1], np.ones(1)
        else:
            row = _linear_fit((particles.positions[own] - point) / spacing)
        rows.append(np.full(len(own), k, dtype=np.intp))
        columns.append(own)
        weights.append(row)
    return csr_array(
        (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))),
        shape=(len(points), particles.count),
    )


def _linear_fit(offsets: Array) -> Array:
    """Weights (m,) of the value at the origin of a linear field known at `offsets` (m, d)."""
    closeness = np.exp(-0.5 * np.sum(offsets**2, axis=1))
    basis = np.column_stack([np.ones(len(offsets)), offsets])
    # The value at the origin is the first coefficient. The pseudo-inverse also works for bodies one
    # particle thick, whose neighbours leave a slope undetermined.
    fitted: Array = np.linalg.pinv(closeness[:, None] * basis, rcond=1e-8)[0] * closeness
    return fitted


def reflected(particles: Particles, ghosts: Indices) -> csr_array:
    """Matrix (k, n) of the point reflection at the surface: twice the value there minus that at
    the image.

    It extends a field smoothly: value and slope agree on both sides of the surface.
    """
    images = particles.images[ghosts]
    surface = 0.5 * (particles.positions[ghosts] + images)
    return csr_array(2.0 * interpolation(particles, surface) - interpolation(particles, images))
