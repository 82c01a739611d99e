"""The paper's time integration."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.integrator import PointwiseIntegrator
from solidsph.maths.arrays import Scalar


@final
@attrs.frozen
class CentralDifference(PointwiseIntegrator):
    """u_n+1 = dt^2 a_n + 2 u_n - u_n-1. Ismail & Reddy, eq. 18.

    Evaluated in h_n = (u_n - u_n-1) / dt: the same in exact arithmetic, but no digits are lost in
    the difference of nearly equal numbers. The velocity of a state is (u_n+1 - u_n-1) / (2 dt).
    """

    order: ClassVar[int] = 2
    stability_limit: ClassVar[float] = 2.0

    @staticmethod
    def mean_velocity(
        velocity: Scalar, acceleration: Scalar, last: Scalar, step_size: float
    ) -> Scalar:
        return last + step_size * acceleration

    @staticmethod
    def end_velocity(mean_velocity: Scalar, acceleration: Scalar, step_size: float) -> Scalar:
        return mean_velocity + 0.5 * step_size * acceleration
