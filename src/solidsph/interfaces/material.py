"""Material: stress and stored energy from the deformation gradient."""

from __future__ import annotations

from abc import abstractmethod
from math import sqrt
from typing import ClassVar

from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Scalar, Tensor


class Material(Part):
    """A hyperelastic law.

    `energy`, `first_piola` and `tangent` are pure pointwise functions written in the words of
    `solidsph.maths.tensors`: F is d x d with components first, in 1D for uniaxial strain, in 2D for
    plane strain. An implementation is a frozen attrs class with a `density` field.
    """

    objective: ClassVar[bool] = True
    """Whether a rigid rotation leaves the energy alone. A law of small strains says False."""

    isotropic: ClassVar[bool] = True
    """Whether all directions are alike at small strain. A law with fibres says False; its Lame
    parameters are then those of an isotropic one that is nowhere less stiff."""

    smooth: ClassVar[bool] = True
    """Whether the tangent is continuous. A law of fibres that go slack says False."""

    @property
    @abstractmethod
    def density(self) -> float:
        """Density in the reference configuration, rho_0 [kg/m^3]."""

    @property
    @abstractmethod
    def params(self) -> tuple[float, ...]:
        """Numbers passed on to the pointwise functions."""

    @property
    @abstractmethod
    def lame_parameters(self) -> tuple[float, float]:
        """Moduli (lambda, mu) of the linear law that holds at small strain [Pa], or bounds it."""

    @staticmethod
    @abstractmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        """Stored energy psi(F) per reference volume [J/m^3], zero at F = I."""

    @staticmethod
    @abstractmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        """First Piola-Kirchhoff stress P = dpsi/dF [Pa]."""

    @staticmethod
    @abstractmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        """Change of stress dP = (dP/dF) : dF along a change dF [Pa]."""

    @property
    def wave_speed(self) -> float:
        """Speed of a confined (uniaxial strain) wave, sqrt((lambda + 2 mu) / rho_0) [m/s]."""
        lam, mu = self.lame_parameters
        return sqrt((lam + 2.0 * mu) / self.density)
