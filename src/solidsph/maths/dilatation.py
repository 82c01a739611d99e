"""Dilatation: the change of volume of a deformation; pointwise."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from solidsph.maths.arrays import Scalar, Tensor
from solidsph.maths.tensors import (
    determinant,
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
    bend: Callable[[Tensor, Tensor], Tensor]  # g, dF -> dg


def _log_volume(F: Tensor) -> Scalar:
    return np.log(determinant(F))


def _log_bend(g: Tensor, dF: Tensor) -> Tensor:
    return scale(-1.0, product(product(g, transpose(dF)), g))


FINITE = Dilatation(of=_log_volume, slope=inverse_transpose, bend=_log_bend)
"""theta = log J."""


def _small_volume(F: Tensor) -> Scalar:
    return trace(F) - len(F)


def _no_bend(g: Tensor, dF: Tensor) -> Tensor:
    return scale(0.0, dF)


SMALL = Dilatation(of=_small_volume, slope=identity, bend=_no_bend)
"""theta = tr F - d, of the linear theory."""
