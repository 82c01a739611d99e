"""Linear elasticity, for small displacements."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import SMALL, Dilatation
from solidsph.maths.tensors import add, contraction, identity, scale, small_strain, trace, transpose
from solidsph.registry.parameters import number
from solidsph_builtin.materials._lame import RUBBER, check_elastic, lame


@final
@attrs.frozen
class LinearElastic(Material):
    """psi = lambda/2 (tr e)^2 + mu e : e, P = lambda tr(e) I + 2 mu e, with e = (F + F^T)/2 - I.

    Hooke's law. A rigid rotation strains it, so it says that it is not objective.
    """

    youngs_modulus: float = number()  # E [Pa]
    poissons_ratio: float = number()  # nu [-]
    density: float = number()  # rho_0 [kg/m^3]

    dilatation: ClassVar[Dilatation | None] = SMALL
    example: ClassVar[Mapping[str, Any]] = RUBBER

    objective: ClassVar[bool] = False

    def __attrs_post_init__(self) -> None:
        check_elastic("linear-elastic", self)

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return lame(self)

    @property
    def params(self) -> tuple[float, ...]:
        return self.lame_parameters

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        lam, mu = params
        e = small_strain(F)
        return 0.5 * lam * trace(e) ** 2 + mu * contraction(e, e)

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        lam, mu = params
        e = small_strain(F)
        return add(scale(lam * trace(e), identity(F)), scale(2.0 * mu, e))

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        lam, mu = params
        return add(scale(lam * trace(dF), identity(F)), scale(mu, add(dF, transpose(dF))))
