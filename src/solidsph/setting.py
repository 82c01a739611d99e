"""Setting: what a part sees of the discrete problem when it is bound to it."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import attrs
from scipy.sparse import block_diag, csr_array

from solidsph.arrays import Array, Indices
from solidsph.body import Body
from solidsph.particles import Particles
from solidsph.where import Where, select


@attrs.frozen(eq=False)
class Setting:
    """The particles of all bodies, their masses, and the bodies themselves."""

    particles: Particles
    masses: Array  # (n,) [kg], 0 for ghosts
    bodies: Sequence[Body]
    step_size: float  # time step of the run [s]
    end: float = inf  # of the scene's duration [s]; a formula of t may have no value beyond it

    def select(self, where: Where) -> Indices:
        """Indices of the particles at `where`.

        Raises:
            SceneError: no particle is there, or `where` cannot be understood.
        """
        return select(self.particles, where)

    def smoothing_matrix(self) -> csr_array:
        """W of the paper's eq. 8, sparse: its product with values gives their approximation."""
        return csr_array(block_diag([_smoothing(body) for body in self.bodies], format="csr"))


def _smoothing(body: Body) -> csr_array:
    pairs = body.pairs()
    weights = body.smoothing.value(pairs.distances)
    return pairs.matrix(weights * body.particles.cells[pairs.columns])
