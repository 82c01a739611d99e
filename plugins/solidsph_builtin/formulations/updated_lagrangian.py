"""The updated Lagrangian form: sums in the current configuration."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Tensor
from solidsph.maths.tensors import add, cauchy_stress, identity, inverse, scale
from solidsph_builtin.divergences.variational import Variational
from solidsph_builtin.gradients.corrected import Corrected


@final
@attrs.frozen
class UpdatedLagrangian(Formulation):
    """F = (I - du/dx)^-1, rho a = div sigma with sigma = P F^T / J. Ismail & Reddy, section 5.2.

    Neighbours and kernel values are recomputed at every step. Under tension neighbouring particles
    attract each other: the tensile instability, which this form demonstrates.
    """

    configuration: ClassVar[Configuration] = Configuration.CURRENT

    gradient: Gradient = attrs.field(factory=Corrected, metadata={"part": "gradients"})
    divergence: Divergence = attrs.field(factory=Variational, metadata={"part": "divergences"})

    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return inverse(add(identity(H), scale(-1.0, H)))

    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return cauchy_stress(F, P)
