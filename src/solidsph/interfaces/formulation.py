"""Formulation: the configuration in which the sums over neighbours are taken, and their fluxes."""

from __future__ import annotations

from abc import abstractmethod
from enum import Enum
from typing import ClassVar, final

import attrs

from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.material import Material
from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Tensor


class Configuration(Enum):
    """Configuration in which neighbours are searched and the kernel is evaluated."""

    REFERENCE = "reference"  # once, at X: the weights are constant
    CURRENT = "current"  # at every step, at x


class Formulation(Part):
    """The steps from displacement to force.

    They are the same in every formulation: the gradient H of the displacement in its
    `configuration`, the deformation gradient F(H), the material's stress P(F), and the divergence
    of flux(F, P).
    """

    configuration: ClassVar[Configuration]

    @property
    @abstractmethod
    def gradient(self) -> Gradient:
        """Gradient operator that gives H."""

    @property
    @abstractmethod
    def divergence(self) -> Divergence:
        """Divergence operator that gives the force."""

    @property
    def filter_above(self) -> float | None:
        """Ratio lambda / mu up to which a body resists rough dilatations in full [-].

        Where it is larger, a filter takes the rest. None, the default, for no filter. For forms
        with F = I + H and the flux P.
        """
        return None

    @final
    def filtered_modulus(self, material: Material, dimension: int) -> float:
        """The bulk modulus that a filter takes from rough dilatations of a material [Pa].

        In one dimension the volume is all that there is.
        """
        if self.filter_above is None or material.dilatation is None or dimension == 1:
            return 0.0
        lam, mu = material.lame_parameters
        return max(0.0, lam - self.filter_above * mu) if mu > 0.0 else 0.0

    @final
    def with_gradient(self, gradient: Gradient) -> Formulation:
        """The same with another gradient."""
        if gradient is self.gradient:
            return self
        # Every formulation is an attrs class with this field, which an interface cannot state.
        result: Formulation = attrs.evolve(self, gradient=gradient)  # type: ignore[misc]
        return result

    @staticmethod
    @abstractmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        """F = dx/dX from the gradient H of the displacement in this configuration; pointwise."""

    @staticmethod
    @abstractmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        """The stress whose divergence in this configuration is force per volume [Pa]; pointwise."""
