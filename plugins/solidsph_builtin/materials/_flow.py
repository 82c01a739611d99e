"""Isochoric plastic flow: the return to the yield surface at a fixed deformation.

The history holds G = C_p^-1, symmetric and of determinant 1. With the isochoric elastic metric
b = J^(-2/3) F G F^T = c I + x n, where n is a deviator of length 1, the deviator of the Kirchhoff
stress is mu x n. At fixed F flow reduces x and keeps n, and c follows from det b = 1. This is the
radial return of Simo (1988) with that last condition added, without which elastic volumes drift.

The equivalent plastic strain is the conjugate of the equivalent stress sqrt(3/2) mu x: the energy
that flow dissipates, mu/2 d(tr b), is exactly equivalent stress times its increment.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from solidsph.interfaces.history import History
from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import (
    add,
    contraction,
    determinant,
    identity,
    inverse_transpose,
    product,
    scale,
    trace,
    transpose,
)

# Length of a deviator over its equivalent stress.
ROOT = sqrt(2.0 / 3.0)

# Newton's method from above, where the cubic is convex: each step squares the error, x^2 / 3 at
# first. Two steps suffice for metals, whose x is some thousandths, five for a flow stress near mu.
_CUBIC_STEPS = 5

# After so small a change of c, which is about 1, what is left is its square.
_SQUARE_IS_ROUNDING = 1e-8

# Relative changes below this are rounding; iterations end there.
ROUNDING = 1e-15

_NONE = 1e-30  # keeps the direction of a zero deviator finite


def metric(history: History, F: Tensor) -> Tensor:
    """G (3, 3) from the first internal variables, its components in the dimensions of F; det G = 1
    gives the others."""
    if len(F) == 1:
        across = 1.0 / np.sqrt(history[0])
        return ((history[0], 0.0, 0.0), (0.0, across, 0.0), (0.0, 0.0, across))
    if len(F) == 2:
        xx, yy, xy = history[0], history[1], history[2]
        return ((xx, xy, 0.0), (xy, yy, 0.0), (0.0, 0.0, 1.0 / (xx * yy - xy * xy)))
    xx, yy, zz = history[0], history[1], history[2]
    yz, xz, xy = history[3], history[4], history[5]
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def elastic_metric(F: Tensor, G: Tensor) -> Tensor:
    """b = J^(-2/3) F G F^T."""
    return scale(determinant(F) ** (-2.0 / 3.0), product(F, product(G, transpose(F))))


def deviator_length(b: Tensor) -> Scalar:
    """x = |dev b|."""
    s = add(b, scale(-trace(b) / 3.0, identity(b)))
    return np.maximum(np.sqrt(contraction(s, s)), _NONE)


def direction_determinant(b: Tensor, x: Scalar) -> Scalar:
    """det n, between -1/sqrt(54) and 1/sqrt(54)."""
    return determinant(scale(1.0 / x, add(b, scale(-trace(b) / 3.0, identity(b)))))


def spherical_part(x: Scalar, det_n: Scalar) -> Scalar:
    """c of det(c I + x n) = c^3 - c x^2 / 2 + x^3 det n = 1."""
    c = 1.0 + 0.5 * x**2  # never below the root
    for _ in range(_CUBIC_STEPS):
        change = (c**3 - 0.5 * c * x**2 + x**3 * det_n - 1.0) / (3.0 * c**2 - 0.5 * x**2)
        c = c - change
        if not np.any(np.abs(change) > _SQUARE_IS_ROUNDING):
            break
    return c


def strain_of_flow(x: Scalar, before: Scalar, det_n: Scalar) -> Scalar:
    """Equivalent plastic strain over the decrease of x from `before`: sqrt(3/2) (dc/dx) / x.

    It is evaluated half way, which makes a step of second order at constant direction.
    """
    half = 0.5 * (x + before)
    c = spherical_part(half, det_n)
    return (c - 3.0 * half * det_n) / (3.0 * c**2 - 0.5 * half**2) / ROOT


def flowed(F: Tensor, G: Tensor, b: Tensor, x: Scalar, before: Scalar, det_n: Scalar) -> Tensor:
    """G after x has decreased from `before`, its value in b: J^(2/3) F^-1 (c I + x n) F^-T."""
    share, B = x / before, inverse_transpose(F)
    rest = spherical_part(x, det_n) - share * trace(b) / 3.0
    sphere = scale(rest * determinant(F) ** (2.0 / 3.0), product(transpose(B), B))
    return add(scale(share, G), sphere)


def chosen(flows: Scalar, after: History, history: History) -> History:
    """`after` where `flows` is 1; where it is 0 the first of the history, to the last bit."""
    stays = 1.0 - flows
    if len(after) == 1:
        return (flows * after[0] + stays * history[0],)
    if len(after) == 3:
        return (
            flows * after[0] + stays * history[0],
            flows * after[1] + stays * history[1],
            flows * after[2] + stays * history[2],
        )
    return (
        flows * after[0] + stays * history[0],
        flows * after[1] + stays * history[1],
        flows * after[2] + stays * history[2],
        flows * after[3] + stays * history[3],
        flows * after[4] + stays * history[4],
        flows * after[5] + stays * history[5],
    )
