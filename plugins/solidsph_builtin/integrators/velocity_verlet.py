"""The velocity Verlet scheme."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.interfaces.integrator import PointwiseIntegrator
from solidsph.maths.arrays import Scalar


@final
@attrs.frozen
class VelocityVerlet(PointwiseIntegrator):
    """Half a kick, a drift, half a kick. Swope et al. (1982).

    Forces that depend on velocity see the one predicted with the old acceleration.
    """

    order: ClassVar[int] = 2
    stability_limit: ClassVar[float] = 2.0

    @staticmethod
    def mean_velocity(
        velocity: Scalar, acceleration: Scalar, last: Scalar, step_size: float
    ) -> Scalar:
        return velocity + 0.5 * step_size * acceleration

    @staticmethod
    def end_velocity(mean_velocity: Scalar, acceleration: Scalar, step_size: float) -> Scalar:
        return mean_velocity + 0.5 * step_size * acceleration
