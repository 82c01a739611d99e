"""Ghosts that extend the body's fields smoothly beyond its surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array

from solidsph.errors import SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.compilable_terms import LinearExtension
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Observation, Term
from solidsph.maths.arrays import Array, Indices
from solidsph.model.regions import Where
from solidsph_builtin.boundaries._images import interpolation, reflected


@final
@attrs.frozen
class GhostExtension(BoundaryHandler):
    """Displacements of ghosts by reflection through the surface value, stresses by mirror images.

    The extension is exact for a linear field. By itself it imposes nothing: it completes the
    support of particles near a surface that another handler holds or loads. Ismail & Reddy,
    section 2.3.
    """

    where: Where = "ghosts"

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        particles = model.particles
        ghosts = chosen_ghosts(model, self.where, "ghost-extension")
        return [
            Extension(
                label=label,
                ghosts=ghosts,
                shape=particles.positions.shape,
                displacement=reflected(particles, ghosts),
                stress=interpolation(particles, particles.images[ghosts]),
            )
        ]


def chosen_ghosts(model: DiscreteModel, where: Where, handler: str) -> Indices:
    """The particles at `where`.

    Raises:
        SceneError: one of them is not a ghost.
    """
    if not model.particles.ghosts.any():
        raise SceneError(
            f"{handler}: the scene has no ghosts; give its discretisation some, such as "
            '{type = "lattice", ghosts = 3}'
        )
    chosen = model.select(where)
    real = chosen[~model.particles.ghosts[chosen]]
    if len(real):
        raise SceneError(
            f"{handler}: {len(real)} particles at where = {where!r} are not ghosts; "
            "choose 'ghosts' or a face's, such as 'left-ghosts'"
        )
    return chosen


@final
@attrs.frozen(eq=False)
class Extension(LinearExtension):
    """Ghost values as linear combinations of the values of real particles."""

    label: str
    ghosts: Indices  # (k,)
    shape: tuple[int, ...]  # (n, d)
    displacement: csr_array  # (k, n)
    stress: csr_array  # (k, n)

    @property
    def signs(self) -> Array:
        return np.ones((len(self.ghosts), self.shape[1]))

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}
