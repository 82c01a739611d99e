"""Fitted: particles that follow the surface of any shape, with volumes that integrate."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.graded_discretisation import GradedDiscretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField
from solidsph.system.build_log import BUILD
from solidsph_builtin.discretisations._cells import mean_spacing
from solidsph_builtin.discretisations._checks import check_spacing
from solidsph_builtin.discretisations._curves import even_points
from solidsph_builtin.discretisations._fitting import fitted, lighter_on_surface
from solidsph_builtin.discretisations._graded import graded
from solidsph_builtin.discretisations._grid import Grid, grid_over, in_chunks
from solidsph_builtin.discretisations._nearest import beside, nearest
from solidsph_builtin.discretisations._relaxation import relaxed
from solidsph_builtin.discretisations._sampled_once import sampled_once
from solidsph_builtin.discretisations._skin import even_skin
from solidsph_builtin.discretisations._surface import faces, sampled, without_ghosts
from solidsph_builtin.discretisations.conforming_lattice import outermost

# In spacings: closer to the boundary there are no particles but those on it, and none closer to
# one of those.
_CLEAR = 0.5
# Further than this from samples of the boundary, in depths, a point is deep: a quarter of a spacing
# is between samples, so that a point at the depth is up to 1.1 depths away from them.
_APART = 1.2
# Depth to which particles move, beside places where the boundary is off the lattice.
_MOVES = 4.0
# Closer to the boundary than this, in depths, a point may be on it.
_AT = 1e-6
# Particles that the others push closer to the boundary than this are left out.
_PUSHED_OUT = 0.2


@final
@attrs.frozen
class Fitted(GradedDiscretisation):
    """Particles on the surface in even steps, and a lattice inside that adapts to them.

    Each corner has a particle, and each edge has them in equal steps. On faces of bodies in space
    they repel each other until they are spread evenly. Inside are the points of a lattice over the
    bounding box; beside a part of the surface that is off the lattice they move, too. A box aligned
    with the axes has the particles of `lattice` with `on_boundary`.

    Nearest neighbours are 0.8 to 1.25 spacings apart. Where edges meet at an angle below 47 degrees
    they are closer at the corner, and so they are where a body is thinner than a spacing or has
    edges closer to each other than that.

    Volumes and areas integrate polynomials of the second degree, as those of `fitted-moments` do.

    Tags: each face of the shape, `surface` and `interior`. There are no ghosts.
    """

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """The particles on the surface and inside, in the order of the lattice.

        Raises:
            SceneError: the spacing is not positive, so large that the body has no particles inside
                its surface, or so small that there would be too many.
        """
        spacing, shape = check_spacing(self, spacing), sampled_once(shape)
        grid = grid_over(self, shape, spacing, on_boundary=True)
        surface = sampled(self, shape, spacing)
        size = mean_spacing(grid, spacing)
        X, onto, irregular = self._arranged(shape, grid, spacing, size)
        outer = np.flatnonzero(onto)
        owners = nearest(cKDTree(X[outer]), surface.points)
        owners = attrs.evolve(owners, particles=outer[owners.particles])
        owned = faces(surface, owners, X)
        whole = np.full(len(X), grid.cell_volume)
        given = without_ghosts(X, whole, size, owned)
        if not irregular:
            return fitted(self, shape, spacing, given)
        return lighter_on_surface(fitted(self, shape, spacing, given, _MOVES * size), shape)

    def graded_particles(self, shape: Shape, spacing: SpacingField) -> Particles:
        """Particles on the surface and inside that repel each other until their distances are even
        and follow the spacing.

        Raises:
            SceneError: there would be too many, or none inside the surface.
        """
        return graded(self, shape, spacing)

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """True: this is what it is for."""
        return True

    def _arranged(
        self, shape: Shape, grid: Grid, spacing: float, size: float
    ) -> tuple[Array, Mask, bool]:
        """Positions (n, d) [m], whether they are on the boundary (n,), and whether any particle is
        off the lattice."""
        BUILD.debug("distances from the surface")
        reach = 2.0 * grid.half_diagonal
        distance = in_chunks(grid.size, lambda n: shape.distance_within(grid.positions(n), reach))
        BUILD.debug("on the surface")
        outer, at_lattice = grid.snapped(_outer(shape, grid, distance, spacing, size))
        inner = grid.positions(_deep(shape, grid, distance, spacing, _CLEAR * size))
        inner = inner[~beside(outer, inner, _CLEAR * size)] if len(inner) else inner
        off = outer[~at_lattice]
        X = np.concatenate([outer, inner])
        onto = np.arange(len(X)) < len(outer)
        if len(off):
            free = ~onto
            free[free] = beside(off, inner, _MOVES * size)
            X = relaxed(X, free, lambda x: np.full(len(x), size))
            onto_or_inside = onto | (shape.distance_within(X, size) < -_PUSHED_OUT * size)
            X, onto = X[onto_or_inside], onto[onto_or_inside]
        order = _order(X, grid)
        return X[order], onto[order], bool(len(off))


def _deep(shape: Shape, grid: Grid, distance: Array, spacing: float, depth: float) -> Indices:
    """Numbers of the points of the lattice at least so deep inside [m].

    The `distance` (size,) [m] may be less than that from the boundary, as at a seam of a union:
    there, that from samples of the boundary decides.
    """
    doubtful = np.flatnonzero((distance <= _AT * depth) & (distance >= -depth))
    samples = cKDTree(shape.surface(spacing).points)
    apart = samples.query(grid.positions(doubtful), distance_upper_bound=_APART * depth)[0]
    return np.union1d(np.flatnonzero(distance < -depth), doubtful[apart > _APART * depth])


def _outer(shape: Shape, grid: Grid, distance: Array, spacing: float, size: float) -> Array:
    """Particles on the boundary, (m, d) [m]; `distance` (size,) [m] is that of the lattice."""
    if shape.dimension == 2:
        return even_points(shape, spacing)
    if shape.dimension == 3:
        return even_skin(shape, grid, distance, spacing, size)
    return outermost(shape, grid, distance, size)[0]


def _order(X: Array, grid: Grid) -> Indices:
    """The order of the lattice, (n,)."""
    places = [*np.round(X / grid.steps, 6).T[list(grid.order)[::-1]], grid.cell_of(X)]
    return np.asarray(np.lexsort(places), dtype=np.intp)
