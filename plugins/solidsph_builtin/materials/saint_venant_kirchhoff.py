"""The Saint Venant-Kirchhoff law: Hooke's law in Green-Lagrange strain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs

from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import GREEN, Dilatation
from solidsph.maths.tensors import (
    add,
    contraction,
    green_lagrange,
    identity,
    product,
    scale,
    trace,
    transpose,
)
from solidsph.registry.parameters import number
from solidsph_builtin.materials._lame import RUBBER, check_elastic, lame


@final
@attrs.frozen
class SaintVenantKirchhoff(Material):
    """psi = lambda/2 (tr E)^2 + mu E : E, P = F S, S = lambda tr(E) I + 2 mu E.

    For large rotations at small to moderate strain: it softens in compression, and its stress
    vanishes again as J goes to 0.
    """

    youngs_modulus: float = number()  # E [Pa]
    poissons_ratio: float = number()  # nu [-]
    density: float = number()  # rho_0 [kg/m^3]

    dilatation: ClassVar[Dilatation | None] = GREEN
    example: ClassVar[Mapping[str, Any]] = RUBBER

    def __attrs_post_init__(self) -> None:
        check_elastic("saint-venant-kirchhoff", self)

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return lame(self)

    @property
    def params(self) -> tuple[float, ...]:
        return self.lame_parameters

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        lam, mu = params
        E = green_lagrange(F)
        return 0.5 * lam * trace(E) ** 2 + mu * contraction(E, E)

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        return product(F, _hooke(green_lagrange(F), params))

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        half = product(transpose(F), dF)
        dE = scale(0.5, add(half, transpose(half)))
        S = _hooke(green_lagrange(F), params)
        return add(product(dF, S), product(F, _hooke(dE, params)))


def _hooke(E: Tensor, params: tuple[float, ...]) -> Tensor:
    lam, mu = params
    return add(scale(lam * trace(E), identity(E)), scale(2.0 * mu, E))
