"""The compressible neo-Hookean law of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import LOGARITHMIC, Dilatation
from solidsph.maths.tensors import (
    add,
    contraction,
    determinant,
    inverse_transpose,
    product,
    scale,
    transpose,
)
from solidsph.registry.parameters import number
from solidsph_builtin.materials._lame import RUBBER, check_elastic, lame


@final
@attrs.frozen
class NeoHookean(Material):
    """psi = mu/2 (tr C - d) - mu ln J + lambda/2 (ln J)^2, P = mu (F - F^-T) + lambda ln J F^-T.

    Ismail & Reddy, eq. 15, where F C^-1 = F^-T; with the stretches across the plane equal to 1.
    """

    youngs_modulus: float = number()  # E [Pa]
    poissons_ratio: float = number()  # nu [-]
    density: float = number()  # rho_0 [kg/m^3]

    dilatation: ClassVar[Dilatation | None] = LOGARITHMIC
    example: ClassVar[Mapping[str, Any]] = RUBBER

    def __attrs_post_init__(self) -> None:
        check_elastic("neo-hookean", self)

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return lame(self)

    @property
    def params(self) -> tuple[float, ...]:
        return self.lame_parameters

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        lam, mu = params
        ln_J = np.log(determinant(F))
        return 0.5 * mu * (contraction(F, F) - len(F)) - mu * ln_J + 0.5 * lam * ln_J**2

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        lam, mu = params
        ln_J = np.log(determinant(F))
        return add(scale(mu, F), scale(lam * ln_J - mu, inverse_transpose(F)))

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        lam, mu = params
        ln_J = np.log(determinant(F))
        B = inverse_transpose(F)
        dB = scale(-1.0, product(B, product(transpose(dF), B)))  # change of F^-T
        return add(
            scale(mu, dF),
            add(scale(lam * contraction(B, dF), B), scale(lam * ln_J - mu, dB)),
        )
