"""Volumes and areas that integrate polynomials, of particles whose spacing varies.

As those of `_fitting.py`, with the functions of every particle as wide as the spacing there.
"""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField, cells_over
from solidsph.system.build_log import BUILD
from solidsph_builtin.discretisations._checks import refusal
from solidsph_builtin.discretisations._fitting import (
    FINER,
    HALVINGS,
    ON_BOUNDARY,
    agreeing,
    faces_by,
    gauss_points,
    lighter_on_surface,
    with_moments,
)
from solidsph_builtin.discretisations._graded_samples import graded_samples
from solidsph_builtin.discretisations._pieces import finest_pieces
from solidsph_builtin.discretisations._reproducing import Fit
from solidsph_builtin.discretisations._surface import area_vectors


def graded_fit(
    discretisation: Discretisation, shape: Shape, spacing: SpacingField, given: Particles
) -> Particles:
    """`given` particles with fitted volumes and, if all their owners are on it, a fitted surface.

    Raises:
        SceneError: a volume would not be positive.
    """
    d, X = shape.dimension, given.positions
    BUILD.debug("volumes of %d", given.count)
    points, weights = _quadrature(shape, spacing)
    everywhere = np.ones(given.count, dtype=np.bool_)
    volumes = Fit(X, spacing.at, None).positive_integrals(points, weights, everywhere)
    volumes = with_moments(X, volumes, everywhere, shape, spacing.least)
    if not np.all(volumes > 0.0):
        worst = int(np.argmin(volumes))
        raise refusal(
            discretisation,
            f"the body is too thin for the spacing of {given.spacings[worst]:.3g} m at "
            f"{X[worst].tolist()}: a particle would have the volume {volumes[worst]:.3g} m^{d}; "
            "use a finer spacing there",
        )
    BUILD.debug("areas on the surface")
    faces = given.faces
    owners = np.unique(np.concatenate([face.particles for face in faces.values()]))
    off = np.abs(shape.signed_distance(X[owners])) / given.spacings[owners]
    if off.max(initial=0.0) <= ON_BOUNDARY:
        surface = graded_samples(discretisation, shape, spacing, FINER[d])
        faces = faces_by(surface, X, given.spacings, faces, lambda own: Fit(own, spacing.at, None))
        faces = agreeing(faces, X, volumes)
    areas = area_vectors(faces, given.count, d)
    made = attrs.evolve(given, volumes=volumes, faces=faces, area_vectors=areas)
    return lighter_on_surface(made, shape)


def _quadrature(shape: Shape, spacing: SpacingField) -> tuple[Array, Array]:
    """Points (m, d) [m] and weights (m,) [m^d] of integrals over `shape`."""
    d = shape.dimension
    cells = cells_over(
        *shape.bounds(), spacing.at, lambda X, reach: shape.signed_distance(X) < reach
    )
    distance = shape.signed_distance(cells.centres)
    whole = distance <= -0.5 * np.sqrt(d) * cells.sizes
    gauss = gauss_points(d)
    sizes = cells.sizes[whole, None, None]
    points = [(cells.centres[whole, None, :] + gauss * sizes).reshape(-1, d)]
    weights = [np.repeat(cells.volumes[whole] / len(gauss), len(gauss))]
    for size in np.unique(cells.sizes[~whole]):
        cut = cells.centres[~whole & (cells.sizes == size)]
        found = finest_pieces(shape, cut, np.full(d, size), HALVINGS[d])
        points.append(found.points)
        weights.append(size**d * found.shares)
    return np.concatenate(points), np.concatenate(weights)
