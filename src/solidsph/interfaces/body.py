"""Body: consecutive particles with one material, kernel support and formulation."""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.material import Material
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Indices
from solidsph.model.dilatation_filter import DilatationFilter
from solidsph.model.neighbours import Hidden, Pairs, neighbour_pairs
from solidsph.model.particles import Particles

# Largest distance of nearest neighbours, in spacings.
_NEAREST = 1.2


@attrs.frozen(eq=False)
class Body:
    """What an engine needs to compute the internal forces of one body."""

    name: str
    shape: Shape  # the region that the particles fill
    extent: slice  # of its particles, among those of all bodies
    particles: Particles  # of this body alone
    smoothing: SmoothingKernel
    material: Material
    formulation: Formulation
    hidden: Hidden | None = None  # near particles that do not see each other
    dilatation_filter: DilatationFilter | None = None

    def pairs(self, radius: float | None = None) -> Pairs:
        """Neighbour pairs in the reference configuration, numbered within the body.

        Each call searches again; a caller keeps what it needs.

        Args:
            radius: largest distance [m], at most the support radius, which is the default. Where
                the spacing varies it is that in the coarsest part, and smaller in proportion.
        """
        H, radii = self.smoothing.support_radius, self.smoothing.radii
        within = H if radius is None else radius
        if radii is None:
            return neighbour_pairs(self.particles.positions, within, self.hidden)
        return neighbour_pairs(self.particles.positions, radii * (within / H), self.hidden)

    @property
    def radii(self) -> Array:
        """Support radius of every particle, (n,) [m]."""
        own = self.smoothing.radii
        return np.full(self.particles.count, self.smoothing.support_radius) if own is None else own

    @cached_property
    def nearest_pairs(self) -> tuple[Indices, Indices]:
        """Particles (m,) and (m,) at most 1.2 spacings apart in the reference, each pair once."""
        particles = self.particles
        if particles.graded:
            found = neighbour_pairs(particles.positions, _NEAREST * particles.spacings)
            pairs = np.column_stack([found.rows, found.columns])[found.rows < found.columns]
        else:
            reach = _NEAREST * float(particles.spacings.max())
            pairs = cKDTree(particles.positions).query_pairs(reach, output_type="ndarray")
        pairs = pairs[~particles.ghosts[pairs].any(axis=1)]
        if self.hidden is not None:
            pairs = pairs[~self.hidden.between(pairs[:, 0], pairs[:, 1])]
        a, b = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
        return np.ascontiguousarray(a), np.ascontiguousarray(b)

    @property
    def masses(self) -> Array:
        """Mass of every particle, (n,) [kg, per unit of the missing dimensions]; 0 for ghosts."""
        return np.where(self.particles.ghosts, 0.0, self.material.density * self.particles.volumes)


def part_of(body: Body, chosen: Indices) -> Body:
    """The body of the chosen particles (k,) alone, renumbered in order, without faces and tags.

    It does not filter its dilatation.
    """
    names = ("positions", "volumes", "spacings", "area_vectors", "ghosts", "images", "cells")
    particles = Particles(**{name: getattr(body.particles, name)[chosen] for name in names})
    return attrs.evolve(
        body,
        particles=particles,
        extent=slice(0, len(chosen)),
        smoothing=body.smoothing.of_part(chosen),
        hidden=None if body.hidden is None else body.hidden.part(chosen),
        dilatation_filter=None,
    )
