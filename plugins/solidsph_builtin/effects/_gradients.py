"""Gradient, divergence and pairs of bodies in the reference configuration, for effects."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import csr_array

from solidsph.engines.matrix import Operators, operators
from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.formulation import Configuration
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs


@attrs.frozen(eq=False)
class BodyGradient:
    """The sums of which the internal forces of one body consist."""

    body: Body
    matrices: Operators

    @classmethod
    def of(cls, body: Body) -> BodyGradient:
        """The gradient of a body."""
        return cls(body, operators(body, body.pairs()))

    @property
    def pair_count(self) -> int:
        """Ordered pairs of neighbours, self pairs included."""
        return self.matrices.gradient.nnz // self.body.particles.dimension

    def gradient(self, field: Array) -> Array:
        """Gradient (d, d, n) of a vector field (n, d) of the body's particles."""
        return self.matrices.gradients(field)

    def forces(self, stress: Array) -> Array:
        """Forces (n, d) [N] of a first Piola-Kirchhoff stress (d, d, n) [Pa]; ghosts have none."""
        return self.matrices.forces(np.where(self.body.particles.ghosts, 0.0, stress))

    def stiffness(self, moduli: Array) -> csr_array:
        """Minus the derivative (d n, d n) [N/m] of these forces, with moduli (n, d, d, d, d) [Pa]
        of the stress: dP_ik / dF_jl."""
        real = np.where(self.body.particles.ghosts[:, None, None, None, None], 0.0, moduli)
        return csr_array(self.matrices.stiffness(real))


def in_the_reference(model: DiscreteModel, effect: str) -> None:
    """Raise SceneError if the formulation of a body is not in the reference configuration."""
    for body in model.bodies:
        if body.formulation.configuration is not Configuration.REFERENCE:
            raise SceneError(
                f"{effect}: it is written in the reference configuration, but the formulation of "
                f"body {body.name!r} follows the motion; use 'total-lagrangian'"
            )


def real_pairs(body: Body, pairs: Pairs) -> Mask:
    """True for pairs of different particles neither of which is a ghost, (m,)."""
    real = ~body.particles.ghosts
    return np.asarray((pairs.distances > 0.0) & real[pairs.rows] & real[pairs.columns])
