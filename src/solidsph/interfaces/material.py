"""Material: stress and stored energy from the deformation gradient."""

from __future__ import annotations

from abc import abstractmethod
from math import sqrt
from typing import ClassVar

from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import Dilatation


class Material(Part):
    """A hyperelastic law.

    `energy`, `first_piola` and `tangent` are pure pointwise functions written in terms of
    `solidsph.maths.tensors`. F is d x d with components first: uniaxial strain in 1D, plane strain
    in 2D. An implementation is a frozen attrs class with a `density` field.
    """

    objective: ClassVar[bool] = True
    """True if a rigid rotation leaves the energy unchanged. False for a small-strain law."""

    isotropic: ClassVar[bool] = True
    """True if all directions are alike at small strain. False for a law with fibres, whose Lame
    parameters are then those of an isotropic law that is nowhere less stiff."""

    dilatation: ClassVar[Dilatation | None] = None
    """The measure theta of a change of volume whose energy in this law is lambda theta^2 / 2, up to
    the third order. Nearly incompressible bodies are filtered in it; none with None."""

    smooth: ClassVar[bool] = True
    """True if the tangent is continuous. False for a law with fibres that go slack."""

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
        """Moduli (lambda, mu) of the linear law at small strain, or of one that bounds it [Pa]."""

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
        """Change of stress dP = (dP/dF) : dF for a change dF [Pa]."""

    @property
    def wave_speed(self) -> float:
        """Speed of a confined (uniaxial strain) wave, sqrt((lambda + 2 mu) / rho_0) [m/s]."""
        lam, mu = self.lame_parameters
        return sqrt((lam + 2.0 * mu) / self.density)
