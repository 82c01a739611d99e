"""Formulation: in which configuration the sums over neighbours are taken, and of what."""

from __future__ import annotations

from abc import abstractmethod
from enum import Enum
from typing import ClassVar

from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Tensor


class Configuration(Enum):
    """Where the neighbours are looked for and the kernel is evaluated."""

    REFERENCE = "reference"  # once, at X: the weights are constant
    CURRENT = "current"  # at every step, at x


class Formulation(Part):
    """From displacement to force in four lines, the same for every formulation:

    the gradient H of the displacement in the formulation's own configuration, the deformation
    gradient F(H), the material's stress P(F), the divergence of flux(F, P).
    """

    configuration: ClassVar[Configuration]

    @property
    @abstractmethod
    def gradient(self) -> Gradient:
        """How H is formed."""

    @property
    @abstractmethod
    def divergence(self) -> Divergence:
        """How the force is formed."""

    @staticmethod
    @abstractmethod
    def deformation_gradient(H: Tensor) -> Tensor:
        """F = dx/dX from the gradient H of the displacement in this configuration; pointwise."""

    @staticmethod
    @abstractmethod
    def flux(F: Tensor, P: Tensor) -> Tensor:
        """The stress whose divergence in this configuration is force per volume [Pa]; pointwise."""
