"""The cubic B-spline."""

from __future__ import annotations

from math import pi
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.kernel import Kernel
from solidsph.maths.arrays import Scalar


@final
@attrs.frozen
class CubicSpline(Kernel):
    """w(q) = 2 (1 - q)^3 - 8 (1/2 - q)^3, each term only where it is positive.

    This is the M4 spline of Monaghan & Lattanzio (1985) with support radius H = 2 h.
    """

    knots: ClassVar[tuple[float, ...]] = (0.5,)

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return 2.0 * np.maximum(1.0 - q, 0.0) ** 3 - 8.0 * np.maximum(0.5 - q, 0.0) ** 3

    @staticmethod
    def slope(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return -6.0 * np.maximum(1.0 - q, 0.0) ** 2 + 24.0 * np.maximum(0.5 - q, 0.0) ** 2

    def closed_normalisation(self, dimension: int) -> float:
        return {1: 4.0 / 3.0, 2: 40.0 / (7.0 * pi), 3: 8.0 / pi}[dimension]
