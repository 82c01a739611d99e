"""The total Lagrangian form: sums in the reference configuration."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.errors import SceneError
from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Tensor
from solidsph.maths.tensors import add, identity
from solidsph.registry.parameters import optional_number
from solidsph_builtin.divergences.variational import Variational
from solidsph_builtin.gradients.corrected import Corrected


@final
@attrs.frozen
class TotalLagrangian(Formulation):
    """F = I + du/dX, rho_0 a = Div P. Ismail & Reddy, eqs. 14 to 17.

    The kernel never moves, so neighbours and weights are found once and the tensile instability
    cannot arise.

    A nearly incompressible material turns every error of the volume into a pressure, many times as
    large, which alternates from particle to particle. Where lambda / mu exceeds `filter_above`, a
    body resists the smooth part of log J in full, and what alternates as one of that ratio does.
    The forces remain the derivative of an energy. (In finite elements part of J is replaced by its
    mean in an element: Nagtegaal, Parks & Rice 1974.)
    """

    configuration: ClassVar[Configuration] = Configuration.REFERENCE

    gradient: Gradient = attrs.field(factory=Corrected, metadata={"part": "gradients"})
    divergence: Divergence = attrs.field(factory=Variational, metadata={"part": "divergences"})
    filter_above: float | None = optional_number()  # lambda / mu [-]

    def __attrs_post_init__(self) -> None:
        if self.filter_above is not None and not self.filter_above >= 0.0:
            raise SceneError(
                f"total-lagrangian: filter_above must not be negative, got {self.filter_above}; it "
                "is a ratio lambda / mu, 10 for Poisson's ratios above 0.45"
            )

    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(identity(H), H)

    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return P
