"""The Mooney-Rivlin law of rubber, with a bulk modulus."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs

from solidsph.errors import SceneError
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.dilatation import POWER, Dilatation
from solidsph.maths.tensors import (
    add,
    contraction,
    determinant,
    inverse_transpose,
    product,
    right_cauchy_green,
    scale,
    trace,
    transpose,
)
from solidsph.registry.parameters import check_positive, number
from solidsph_builtin.materials._isochoric import (
    bulk_energy,
    bulk_stress,
    bulk_tangent,
    change_of_inverse,
)
from solidsph_builtin.materials._wide import narrowed, widened, widened_change


@final
@attrs.frozen
class MooneyRivlin(Material):
    """psi = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + kappa/2 ((J^2 - 1)/2 - ln J).

    Mooney (1940), Rivlin (1948); the invariants of C = F^T F freed of volume, Flory (1961). The
    shear modulus is 2 (C10 + C01).
    """

    c10: float = number()  # [Pa]
    c01: float = number()  # [Pa]; may be slightly negative
    bulk_modulus: float = number()  # kappa [Pa]
    density: float = number()  # rho_0 [kg/m^3]

    dilatation: ClassVar[Dilatation | None] = POWER
    example: ClassVar[Mapping[str, Any]] = {
        "c10": 1.5e5,
        "c01": 0.4e5,
        "bulk_modulus": 1e6 / 1.2,
        "density": 1000.0,
    }

    def __attrs_post_init__(self) -> None:
        check_positive("material 'mooney-rivlin'", "bulk_modulus", self.bulk_modulus, "Pa")
        check_positive("material 'mooney-rivlin'", "density", self.density, "kg/m^3")
        if not 0.0 < self.c10 + self.c01 < 1e100:
            raise SceneError(
                "material 'mooney-rivlin': c10 + c01 is half the shear modulus and must be "
                f"positive, got {self.c10} + {self.c01} Pa"
            )

    @property
    def lame_parameters(self) -> tuple[float, float]:
        mu = 2.0 * (self.c10 + self.c01)
        return self.bulk_modulus - 2.0 / 3.0 * mu, mu

    @property
    def params(self) -> tuple[float, ...]:
        return (self.c10, self.c01, self.bulk_modulus)

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        c10, c01, kappa = params
        C, J = right_cauchy_green(widened(F)), determinant(F)
        first, second = trace(C), 0.5 * (trace(C) ** 2 - contraction(C, C))
        shape = c10 * (J ** (-2.0 / 3.0) * first - 3.0) + c01 * (J ** (-4.0 / 3.0) * second - 3.0)
        return shape + bulk_energy(J, kappa)

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        c10, c01, kappa = params
        wide, J = widened(F), determinant(F)
        C, B = right_cauchy_green(wide), inverse_transpose(wide)
        first, second = trace(C), 0.5 * (trace(C) ** 2 - contraction(C, C))
        of_first = add(wide, scale(-first / 3.0, B))
        half = add(scale(first, wide), scale(-1.0, product(wide, C)))  # of the change of I2
        of_second = add(half, scale(-2.0 / 3.0 * second, B))
        shape = add(
            scale(2.0 * c10 * J ** (-2.0 / 3.0), of_first),
            scale(2.0 * c01 * J ** (-4.0 / 3.0), of_second),
        )
        return narrowed(add(shape, bulk_stress(J, B, kappa)), F)

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        c10, c01, kappa = params
        wide, along, J = widened(F), widened_change(dF), determinant(F)
        C, B = right_cauchy_green(wide), inverse_transpose(wide)
        dB, dln_J = change_of_inverse(B, along), contraction(B, along)
        first, second = trace(C), 0.5 * (trace(C) ** 2 - contraction(C, C))
        dfirst = 2.0 * contraction(wide, along)
        half = add(scale(first, wide), scale(-1.0, product(wide, C)))
        dC = add(product(transpose(along), wide), product(transpose(wide), along))
        dhalf = add(
            add(scale(dfirst, wide), scale(first, along)),
            scale(-1.0, add(product(along, C), product(wide, dC))),
        )
        of_first, of_second = (
            add(wide, scale(-first / 3.0, B)),
            add(half, scale(-2.0 / 3.0 * second, B)),
        )
        dof_first = add(along, add(scale(-dfirst / 3.0, B), scale(-first / 3.0, dB)))
        dsecond = 2.0 * contraction(half, along)
        dof_second = add(dhalf, add(scale(-2.0 / 3.0 * dsecond, B), scale(-2.0 / 3.0 * second, dB)))
        change = add(
            scale(
                2.0 * c10 * J ** (-2.0 / 3.0),
                add(dof_first, scale(-2.0 / 3.0 * dln_J, of_first)),
            ),
            scale(
                2.0 * c01 * J ** (-4.0 / 3.0),
                add(dof_second, scale(-4.0 / 3.0 * dln_J, of_second)),
            ),
        )
        return narrowed(add(change, bulk_tangent(J, B, along, kappa)), F)
