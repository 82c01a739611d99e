"""Body: one run of particles with its own material, kernel support and neighbours."""

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
from solidsph.model.neighbours import Hidden, Pairs, neighbour_pairs
from solidsph.model.particles import Particles

# Of nearest neighbours, in spacings.
_NEAREST = 1.2


@attrs.frozen(eq=False)
class Body:
    """What an engine needs to know to find the internal forces of one body."""

    name: str
    shape: Shape  # that its particles fill
    extent: slice  # its place among all particles
    particles: Particles  # its own only
    smoothing: SmoothingKernel
    material: Material
    formulation: Formulation
    hidden: Hidden | None = None  # near particles that do not see each other

    def pairs(self, radius: float | None = None) -> Pairs:
        """Neighbours in the reference configuration, numbered within the body: within the support,
        or within a smaller `radius` [m].

        Found anew at every call: an engine that needs them for longer keeps what it needs.
        """
        within = self.smoothing.support_radius if radius is None else radius
        return neighbour_pairs(self.particles.positions, within, self.hidden)

    @cached_property
    def nearest_pairs(self) -> tuple[Indices, Indices]:
        """Particles (m,) and (m,) up to 1.2 spacings apart in the reference, each pair once."""
        particles = self.particles
        reach = _NEAREST * float(particles.spacings.max())
        pairs = cKDTree(particles.positions).query_pairs(reach, output_type="ndarray")
        pairs = pairs[~particles.ghosts[pairs].any(axis=1)]
        if self.hidden is not None:
            pairs = pairs[~self.hidden.between(pairs[:, 0], pairs[:, 1])]
        a, b = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
        return np.ascontiguousarray(a), np.ascontiguousarray(b)

    @property
    def masses(self) -> Array:
        """(n,) [kg, per unit of the missing dimensions]; ghosts have none."""
        return np.where(self.particles.ghosts, 0.0, self.material.density * self.particles.volumes)


def part_of(body: Body, chosen: Indices) -> Body:
    """The same body of these particles (k,) alone, numbered in their order, without faces or
    tags."""
    own = body.particles
    particles = Particles(
        positions=own.positions[chosen],
        volumes=own.volumes[chosen],
        spacings=own.spacings[chosen],
        area_vectors=own.area_vectors[chosen],
        ghosts=own.ghosts[chosen],
        images=own.images[chosen],
        cells=own.cells[chosen],
    )
    hidden = None if body.hidden is None else body.hidden.part(chosen)
    return attrs.evolve(body, particles=particles, extent=slice(0, len(chosen)), hidden=hidden)
