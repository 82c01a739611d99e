"""A material that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import ClassVar

import attrs
import numpy as np

from solidsph import (
    Material,
)
from solidsph.interfaces.history import History
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import (
    add,
    contraction,
    green_lagrange,
    identity,
    product,
    scale,
    small_strain,
    trace,
    transpose,
)
from solidsph_builtin.materials.viscoelastic import Viscoelastic, advance_of, stress_of

LAM, MU = 2.0e6, 1.0e6


def hooke(strain: Tensor) -> Tensor:
    return add(scale(LAM * trace(strain), identity(strain)), scale(2.0 * MU, strain))


@attrs.frozen
class GoodMaterial(Material):
    """psi = lambda/2 (tr E)^2 + mu E : E."""

    density: float = 1000.0

    @property
    def params(self) -> tuple[float, ...]:
        return ()

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return LAM, MU

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        E = green_lagrange(F)
        return 0.5 * contraction(hooke(E), E)

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(F, hooke(green_lagrange(F)))

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        half = product(transpose(F), dF)
        dE = scale(0.5, add(half, transpose(half)))
        return add(product(dF, hooke(green_lagrange(F))), product(F, hooke(dE)))


class WrongStress(GoodMaterial):
    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return scale(1.0 + 1e-8, GoodMaterial.first_piola(F, params))


class TangentWithoutInitialStress(GoodMaterial):
    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        half = product(transpose(F), dF)
        return product(F, hooke(scale(0.5, add(half, transpose(half)))))


class UnsymmetricTangent(GoodMaterial):
    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(GoodMaterial.tangent(F, dF, params), F)


class Prestressed(GoodMaterial):
    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return GoodMaterial.energy(F, params) + 1e-3 * MU * trace(green_lagrange(F))

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return add(GoodMaterial.first_piola(F, params), scale(1e-3 * MU, F))


class SmallStrainOnly(GoodMaterial):
    """Claims to be objective, as the interface does by default."""

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return 0.5 * contraction(hooke(small_strain(F)), small_strain(F))

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return hooke(small_strain(F))


class TooModest(GoodMaterial):
    objective: ClassVar[bool] = False


class OtherConstants(GoodMaterial):
    @property
    def lame_parameters(self) -> tuple[float, float]:
        return LAM, 1.001 * MU


class BulkWaveSpeed(GoodMaterial):
    @property
    def wave_speed(self) -> float:
        return sqrt((LAM + 2.0 / 3.0 * MU) / self.density)


class OtherPlane(GoodMaterial):
    """Its missing strains are those of no lateral stress."""

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        missing = -LAM / (LAM + 2.0 * MU) * trace(green_lagrange(F)) * (len(F) < 3)
        return GoodMaterial.energy(F, params) + 0.5 * LAM * missing**2


class ArraysOnly(GoodMaterial):
    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return GoodMaterial.energy(F, params) * np.ones(F.shape[2])


class TurnedStress(GoodMaterial):
    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(hooke(green_lagrange(F)), F)


class Softening(GoodMaterial):
    """Its shear modulus is negative, though it declares another."""

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        return scale(-1.0, GoodMaterial.tangent(F, dF, params))


class GoodMemory(Viscoelastic):
    """One Maxwell element beside a neo-Hookean spring."""

    def __init__(self) -> None:
        super().__init__([(0.5, 1e-2)], 1e6, 0.3, 1000.0)


class BornOld(GoodMemory):
    def initial_history(self, dimension: int) -> Mapping[str, float]:
        return dict.fromkeys(super().initial_history(dimension), 1e-3)


class StressOfTheVirgin(GoodMemory):
    @staticmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        return Viscoelastic.first_piola(F, params)


def _elements(params: tuple[float, ...]) -> int:
    return (len(params) - 2) // 2


class GivesBack(GoodMemory):
    @staticmethod
    def dissipated(history: History) -> Scalar:
        return -history[-1]


class Silent(GoodMemory):
    @staticmethod
    def dissipated(history: History) -> Scalar:
        return 0.0 * history[-1]


class RemembersDirections(GoodMemory):
    """Its viscous strain follows the left Cauchy-Green tensor, which turns with the body."""

    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        return advance_of(_elements(params))(transpose(F), history, step, params)


class TurnedMemory(GoodMemory):
    @staticmethod
    def stress(F: Tensor, history: History, params: tuple[float, ...]) -> Tensor:
        return transpose(stress_of(_elements(params))(F, history, params))


class FlatMemory(GoodMemory):
    """Relaxes sooner where dimensions are missing."""

    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        return advance_of(_elements(params))(F, history, step * 3.0 / len(F), params)


class Hasty(GoodMemory):
    rate_dependent: ClassVar[bool] = False


class MemoryOfArraysOnly(GoodMemory):
    @staticmethod
    def advance(F: Tensor, history: History, step: float, params: tuple[float, ...]) -> History:
        return tuple(
            one * np.ones(F.shape[2])
            for one in advance_of(_elements(params))(F, history, step, params)
        )


MEMORIES = [
    (BornOld, {"virgin state"}),
    (StressOfTheVirgin, {"stress with history"}),
    (GivesBack, {"dissipation"}),
    (Silent, {"energy balance"}),
    (RemembersDirections, {"objectivity of history"}),
    (TurnedMemory, {"angular momentum of history"}),
    (FlatMemory, {"missing dimensions of history"}),
    (Hasty, {"rate dependence"}),
    (MemoryOfArraysOnly, {"pointwise history"}),
]


MATERIALS = [
    *MEMORIES,
    (TurnedStress, {"stress measures"}),
    (Softening, {"ellipticity"}),
    (WrongStress, {"stress"}),
    (TangentWithoutInitialStress, {"tangent"}),
    (UnsymmetricTangent, {"symmetric tangent"}),
    (Prestressed, {"natural state"}),
    (SmallStrainOnly, {"objectivity", "angular momentum"}),
    (TooModest, {"objectivity"}),
    (OtherConstants, {"small strain"}),
    (BulkWaveSpeed, {"wave speed"}),
    (OtherPlane, {"missing dimensions"}),
    (ArraysOnly, {"pointwise"}),
]
