"""The gradient and the divergence of a body in the reference configuration, for effects."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.engines.matrix import Operators, operators
from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.formulation import Configuration
from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class BodyGradient:
    """The sums that the internal forces of one body are made of."""

    body: Body
    matrices: Operators

    @classmethod
    def of(cls, body: Body) -> BodyGradient:
        """That of a body."""
        return cls(body, operators(body, body.pairs()))

    @property
    def pair_count(self) -> int:
        """Ordered pairs of neighbours, self pairs included."""
        return self.matrices.gradient.nnz // self.body.particles.dimension

    def gradient(self, field: Array) -> Array:
        """Gradient (d, d, n) of a vector field (n, d) of the body's particles."""
        n, d = field.shape
        along = (self.matrices.gradient @ field).reshape(d, n, d)
        return np.asarray(along.transpose(2, 0, 1))

    def forces(self, stress: Array) -> Array:
        """Forces (n, d) [N] of a first Piola-Kirchhoff stress (d, d, n) [Pa]; ghosts have none."""
        d = len(stress)
        own = np.where(self.body.particles.ghosts, 0.0, stress)
        return np.asarray(self.matrices.force @ own.transpose(1, 2, 0).reshape(-1, d))


def in_the_reference(model: DiscreteModel, effect: str) -> None:
    """Raise SceneError unless the formulations of all bodies have their pairs in the reference."""
    for body in model.bodies:
        if body.formulation.configuration is not Configuration.REFERENCE:
            raise SceneError(
                f"{effect}: it is written in the reference configuration, but the formulation of "
                f"body {body.name!r} follows the motion; use 'total-lagrangian'"
            )
