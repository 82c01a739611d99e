"""Energy of a change of volume plus that of an isochoric change of shape.

psi = kappa/2 ((J^2 - 1)/2 - ln J) + mu/2 (J^(-2/3) C : G - 3), Simo & Hughes (1998), eq. 9.2.3,
with a symmetric G of determinant 1: the inverse of a plastic metric, or I. All tensors are (3, 3).
"""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import (
    add,
    contraction,
    determinant,
    inverse_transpose,
    product,
    scale,
    transpose,
)


def bulk_energy(J: Scalar, kappa: float) -> Scalar:
    """kappa/2 ((J^2 - 1)/2 - ln J)."""
    return 0.5 * kappa * (0.5 * (J**2 - 1.0) - np.log(J))


def bulk_stress(J: Scalar, B: Tensor, kappa: float) -> Tensor:
    """Its derivative by F, with B = F^-T."""
    return scale(0.5 * kappa * (J**2 - 1.0), B)


def bulk_tangent(J: Scalar, B: Tensor, dF: Tensor, kappa: float) -> Tensor:
    """Change of that stress along a change of F."""
    along = scale(kappa * J**2 * contraction(B, dF), B)
    return add(along, scale(0.5 * kappa * (J**2 - 1.0), change_of_inverse(B, dF)))


def change_of_inverse(B: Tensor, dF: Tensor) -> Tensor:
    """Change of B = F^-T along a change of F."""
    return scale(-1.0, product(B, product(transpose(dF), B)))


def energy_of(F: Tensor, G: Tensor, kappa: float, mu: float) -> Scalar:
    """psi(F, G)."""
    J = determinant(F)
    shape = J ** (-2.0 / 3.0) * contraction(product(F, G), F)
    return bulk_energy(J, kappa) + 0.5 * mu * (shape - 3.0)


def stress_of(F: Tensor, G: Tensor, kappa: float, mu: float) -> Tensor:
    """P = dpsi/dF at fixed G."""
    J, B, FG = determinant(F), inverse_transpose(F), product(F, G)
    deviator = add(FG, scale(-contraction(FG, F) / 3.0, B))
    return add(bulk_stress(J, B, kappa), scale(mu * J ** (-2.0 / 3.0), deviator))


def tangent_of(F: Tensor, dF: Tensor, kappa: float, mu: float) -> Tensor:
    """Change of P along a change of F, for G = I."""
    J, B = determinant(F), inverse_transpose(F)
    dB, square = change_of_inverse(B, dF), contraction(F, F)
    deviator = add(F, scale(-square / 3.0, B))
    change = add(
        add(scale(-2.0 / 3.0 * contraction(B, dF), deviator), dF),
        add(scale(-2.0 / 3.0 * contraction(F, dF), B), scale(-square / 3.0, dB)),
    )
    return add(bulk_tangent(J, B, dF, kappa), scale(mu * J ** (-2.0 / 3.0), change))
