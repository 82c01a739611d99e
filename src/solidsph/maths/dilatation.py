"""Dilatation: the change of volume of a deformation; pointwise.

There are several measures theta of it. That of a material is the one in which its energy of a
change of volume is lambda theta^2 / 2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import (
    add,
    contraction,
    determinant,
    green_lagrange,
    identity,
    inverse_transpose,
    product,
    scale,
    trace,
    transpose,
)


class Dilatation(NamedTuple):
    """A measure of it, with its derivatives."""

    of: Callable[[Tensor], Scalar]  # F -> theta
    slope: Callable[[Tensor], Tensor]  # F -> g = dtheta / dF
    bend: Callable[[Tensor, Tensor], Tensor]  # F, dF -> dg


def _log_volume(F: Tensor) -> Scalar:
    return np.log(determinant(F))


def _log_bend(F: Tensor, dF: Tensor) -> Tensor:
    B = inverse_transpose(F)
    return scale(-1.0, product(product(B, transpose(dF)), B))


LOGARITHMIC = Dilatation(of=_log_volume, slope=inverse_transpose, bend=_log_bend)
"""theta = log J."""


def _power(F: Tensor) -> Scalar:
    return 1.5 * (determinant(F) ** (2.0 / 3.0) - 1.0)


def _power_slope(F: Tensor) -> Tensor:
    return scale(determinant(F) ** (2.0 / 3.0), inverse_transpose(F))


def _power_bend(F: Tensor, dF: Tensor) -> Tensor:
    growth = 2.0 / 3.0 * contraction(inverse_transpose(F), dF)
    change = add(scale(growth, inverse_transpose(F)), _log_bend(F, dF))
    return scale(determinant(F) ** (2.0 / 3.0), change)


POWER = Dilatation(of=_power, slope=_power_slope, bend=_power_bend)
"""theta = 3/2 (J^(2/3) - 1), whose square is (J^2 - 1)/2 - log J up to the fourth order."""


def _trace_of_strain(F: Tensor) -> Scalar:
    return trace(green_lagrange(F))


def _itself(F: Tensor) -> Tensor:
    return F


def _change(F: Tensor, dF: Tensor) -> Tensor:
    return dF


GREEN = Dilatation(of=_trace_of_strain, slope=_itself, bend=_change)
"""theta = tr E, of the Green-Lagrange strain."""


def _small_volume(F: Tensor) -> Scalar:
    return trace(F) - len(F)


def _no_bend(F: Tensor, dF: Tensor) -> Tensor:
    return scale(0.0, dF)


SMALL = Dilatation(of=_small_volume, slope=identity, bend=_no_bend)
"""theta = tr F - d, of the linear theory."""
