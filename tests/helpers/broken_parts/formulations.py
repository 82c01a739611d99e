"""A formulation that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from typing import ClassVar

import attrs

from solidsph import (
    Divergence,
    Formulation,
    Gradient,
)
from solidsph.interfaces.formulation import Configuration
from solidsph.maths.arrays import Array, Tensor
from solidsph.maths.tensors import (
    add,
    identity,
    scale,
    transpose,
)
from solidsph.model.neighbours import Pairs
from solidsph.testing import example_part
from tests.helpers.broken_parts.gradients import ClaimsConstant


@attrs.frozen
class GoodFormulation(Formulation):
    """F = I + du/dX, rho_0 a = Div P."""

    configuration: ClassVar[Configuration] = Configuration.REFERENCE

    gradient: Gradient = attrs.field(factory=lambda: example_part("gradients", "corrected"))
    divergence: Divergence = attrs.field(factory=lambda: example_part("divergences", "variational"))

    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(identity(H), H)

    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return P


class Transposed(GoodFormulation):
    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(identity(H), transpose(H))


class AlwaysStretched(GoodFormulation):
    @staticmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        return add(scale(1.0 + 1e-6, identity(H)), H)


class TransposedStress(GoodFormulation):
    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return transpose(P)


class WeakStress(GoodFormulation):
    @staticmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        return scale(1.0 - 1e-8, P)


class WrongStressInCurrent(GoodFormulation):
    configuration: ClassVar[Configuration] = Configuration.CURRENT


def with_false_gradient() -> Formulation:
    return GoodFormulation(gradient=ClaimsConstant())


@attrs.frozen
class ClaimsEverything(Divergence):
    conserves_momentum: ClassVar[bool] = True
    adjoint: ClassVar[bool] = True
    uses_ghost_stress: ClassVar[bool] = True

    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        return volumes[pairs.rows, None] * gradient_weights


def with_false_divergence() -> Formulation:
    return GoodFormulation(divergence=ClaimsEverything())


FORMULATIONS = [
    (Transposed, {"rigid motion", "linear patch"}),
    (AlwaysStretched, {"rest", "rigid motion"}),
    (TransposedStress, {"angular momentum"}),
    (WeakStress, {"energy gradient"}),
    (WrongStressInCurrent, {"angular momentum"}),
    (with_false_gradient, {"translation"}),
    (with_false_divergence, {"linear momentum", "angular momentum", "adjoint"}),
]
