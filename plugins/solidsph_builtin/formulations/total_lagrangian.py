"""The total Lagrangian form: sums in the reference configuration."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Tensor
from solidsph.maths.tensors import add, identity
from solidsph_builtin.divergences.variational import Variational
from solidsph_builtin.gradients.corrected import Corrected


@final
@attrs.frozen
class TotalLagrangian(Formulation):
    """F = I + du/dX, rho_0 a = Div P. Ismail & Reddy, eqs. 14 to 17.

    The kernel never moves, so neighbours and weights are found once and the tensile instability
    cannot arise.
    """

    configuration: ClassVar[Configuration] = Configuration.REFERENCE

    gradient: Gradient = attrs.field(factory=Corrected, metadata={"part": "gradients"})
    divergence: Divergence = attrs.field(factory=Variational, metadata={"part": "divergences"})

    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(identity(H), H)

    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return P
