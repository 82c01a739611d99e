"""Smoothed volume fraction of a body, in which a lattice does not show."""

from __future__ import annotations

from math import pi
from typing import ClassVar, final

import attrs
import numpy as np
from numpy.polynomial.legendre import leggauss

from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import SmoothingKernel, smoothing_kernel
from solidsph.maths.arrays import Array, Scalar

REACH = 2.5
"""Support radius of the smoothing in spacings: along a lattice the position at which bodies touch
then varies by less than a thousandth of a spacing, in 2D by less than a ten-thousandth."""

_NODES, _WEIGHTS = leggauss(64)


@final
@attrs.frozen
class _QuinticSpline(Kernel):
    """The M6 spline of Schoenberg (1946), which reproduces a constant on a lattice to 3e-4."""

    knots: ClassVar[tuple[float, ...]] = (1.0 / 3.0, 2.0 / 3.0)

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (
            np.maximum(1.0 - q, 0.0) ** 5
            - 6.0 * np.maximum(2.0 / 3.0 - q, 0.0) ** 5
            + 15.0 * np.maximum(1.0 / 3.0 - q, 0.0) ** 5
        )

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (
            -5.0 * np.maximum(1.0 - q, 0.0) ** 4
            + 30.0 * np.maximum(2.0 / 3.0 - q, 0.0) ** 4
            - 75.0 * np.maximum(1.0 / 3.0 - q, 0.0) ** 4
        )


def crowding_kernel(dimension: int, radius: float) -> SmoothingKernel:
    """The smoothing kernel with a support radius [m]."""
    return smoothing_kernel(_QuinticSpline(), dimension, radius)


def steepest(kernel: SmoothingKernel) -> float:
    """Largest gradient of the volume fraction of a body, at its surface [1/m]."""
    return float(layer(kernel, np.zeros(1))[0])


def sensitivity(kernel: SmoothingKernel, excess: float) -> float:
    """Bound on the squared angular frequency of contact, over K / rho [1/m^2].

    The excess of a particle has the gradient g, and K V g g^T is its stiffness. The absolute values
    in a row of the mass-weighted Gram matrix of all g add up to at most the square of the integral
    of |dW/dr|. The geometric stiffness adds twice the integral of |W''| times the excess.
    """
    d, H = kernel.dimension, kernel.support_radius
    r = np.linspace(0.0, H, 2001)
    slope = kernel.slope(r)
    middle = 0.5 * (r[1:] + r[:-1])
    area = {1: np.full(2000, 2.0), 2: 2.0 * pi * middle, 3: 4.0 * pi * middle**2}[d]
    first = float(area @ np.abs(0.5 * (slope[1:] + slope[:-1]))) * H / 2000
    second = float(area @ np.abs(np.diff(slope)))
    return first**2 + 2.0 * excess * second


def layer(kernel: SmoothingKernel, heights: Array) -> Array:
    """W integrated over a plane at distances `heights` (m,) [m], (m,) [1/m]."""
    d, H = kernel.dimension, kernel.support_radius
    if d == 1:
        return kernel.value(heights)
    widest = np.sqrt(np.maximum(H**2 - heights**2, 0.0))
    across = 0.5 * widest[:, None] * (_NODES + 1.0)
    values = kernel.value(np.sqrt(heights[:, None] ** 2 + across**2))
    area = 2.0 if d == 2 else 2.0 * pi * across
    result: Array = 0.5 * widest * np.sum(_WEIGHTS * area * values, axis=1)
    return result
