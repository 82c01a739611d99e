"""Waves of finite amplitude in the paper's law, in uniaxial strain: exact solutions.

The nominal stress P(s) of a stretch s is concave, so stiffer in compression. An end that is pushed
at a constant velocity sends a shock, since what comes later is faster; one that is pulled a fan,
in which what comes later is slower. Both are functions of X / t, with X the reference position.
"""

from __future__ import annotations

from math import exp, log
from typing import final

import attrs
import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array

_EXACT = 1e-14  # relative tolerance of roots and of quadrature


@final
@attrs.frozen
class Law:
    """P(s) = mu (s - 1/s) + lambda ln s / s, Ismail & Reddy's eq. 15 in uniaxial strain."""

    lam: float  # lambda [Pa]
    mu: float  # [Pa]
    density: float  # rho_0 [kg/m^3]

    def stress(self, s: Array | float) -> Array:
        """P [Pa] at stretches."""
        return np.asarray(self.mu * (s - 1.0 / s) + self.lam * np.log(s) / s)

    def stiffness(self, s: Array | float) -> Array:
        """dP/ds [Pa]."""
        return np.asarray((self.mu * (s**2 + 1.0) + self.lam * (1.0 - np.log(s))) / s**2)

    def speed(self, s: Array | float) -> Array:
        """c(s) of a small wave on top of a stretch, in the reference configuration [m/s]."""
        return np.asarray(np.sqrt(self.stiffness(s) / self.density))

    def energy(self, s: float) -> float:
        """psi per reference volume [J/m^3]."""
        return 0.5 * self.mu * (s * s - 1.0) - self.mu * log(s) + 0.5 * self.lam * log(s) ** 2

    @property
    def small_speed(self) -> float:
        """c(1), the confined wave speed [m/s]."""
        return float(self.speed(1.0))

    @property
    def last_concave(self) -> float:
        """Stretch at which P'' = (lambda (2 ln s - 3) - 2 mu) / s^3 turns positive."""
        return exp(1.5 + self.mu / self.lam)

    def fan_velocity(self, s: float) -> float:
        """Integral of c from 1 to s: the velocity that a simple wave gives [m/s]."""
        return float(quad(lambda r: float(self.speed(r)), 1.0, s, epsabs=0.0, epsrel=1e-12)[0])

    @property
    def largest_pull(self) -> float:
        """Velocity up to which a pull is a fan alone; beyond it a shock follows the fan [m/s]."""
        return self.fan_velocity(self.last_concave)

    def pushed(self, velocity: float) -> FiniteWave:
        """What an end sends that is moved into the bar at `velocity` > 0 [m/s].

        With [P] = -rho U [v] and [v] = -U [s] for a wave to the right: rho v^2 = P(s) (s - 1).
        Any velocity has its shock, as P(s) falls without bound.
        """

        def excess(s: float) -> float:
            return float(self.stress(s)) * (s - 1.0) / self.density - velocity**2

        low = 0.5
        while excess(low) < 0.0:
            low *= 0.5
        s = float(brentq(excess, low, 1.0 - 1e-12, xtol=1e-15, rtol=_EXACT))
        return FiniteWave(self, velocity, s)

    def pulled(self, velocity: float) -> FiniteWave:
        """What an end sends that is moved away from the bar at `velocity` > 0 [m/s].

        Raises:
            SceneError: the velocity is beyond that of a fan alone.
        """
        if not velocity <= self.largest_pull:
            raise SceneError(
                f"a pull of {velocity:.6g} m/s stretches the bar beyond {self.last_concave:.4g}, "
                f"where the law is no longer concave; the largest that is a simple wave is "
                f"{self.largest_pull:.6g} m/s"
            )

        def excess(s: float) -> float:
            return self.fan_velocity(s) - velocity

        s = float(brentq(excess, 1.0, self.last_concave, xtol=1e-15, rtol=_EXACT))
        return FiniteWave(self, -velocity, s)


@final
@attrs.frozen
class FiniteWave:
    """A wave into a bar at rest whose end at X = 0 moves at a constant velocity.

    A shock, pushed, jumps from rest to `stretch` < 1 at the speed U = velocity / (1 - stretch). A
    fan, pulled, is a simple wave: X / t = c(s), v = -integral of c from 1 to `stretch`.
    """

    law: Law
    velocity: float  # of the end, positive into the bar [m/s]
    stretch: float  # behind the wave

    @property
    def is_shock(self) -> bool:
        """True for a push, False for a pull."""
        return self.velocity > 0.0

    @property
    def stress(self) -> float:
        """P behind the wave [Pa]."""
        return float(self.law.stress(self.stretch))

    @property
    def head(self) -> float:
        """Speed of its first part [m/s]."""
        return self.velocity / (1.0 - self.stretch) if self.is_shock else self.law.small_speed

    @property
    def tail(self) -> float:
        """Speed of its last part, behind which all is uniform [m/s]."""
        return self.head if self.is_shock else float(self.law.speed(self.stretch))

    @property
    def half_speed(self) -> float:
        """Speed of the level of half the stress behind the wave [m/s]."""
        if self.is_shock:
            return self.head

        def excess(s: float) -> float:
            return float(self.law.stress(s)) - 0.5 * self.stress

        return float(self.law.speed(brentq(excess, 1.0, self.stretch, xtol=1e-15, rtol=_EXACT)))

    @property
    def dissipation(self) -> float:
        """Power that a shock takes from the mechanical energy, per area [W/m^2].

        What the end supplies, -P v, less what the shock leaves behind, U (psi + rho v^2 / 2).
        """
        kept = self.law.energy(self.stretch) + 0.5 * self.law.density * self.velocity**2
        return -self.stress * self.velocity - self.head * kept

    def stresses(self, speeds: Array) -> Array:
        """P [Pa] at X / t = `speeds` [m/s]."""
        return self.law.stress(self.stretches(speeds))

    def stretches(self, speeds: Array) -> Array:
        """Stretch at X / t = `speeds` [m/s]."""
        head, tail = self.head, self.tail

        def at(speed: float) -> float:
            if speed < tail:
                return self.stretch
            if speed >= head:
                return 1.0
            return float(
                brentq(lambda s: float(self.law.speed(s)) - speed, 1.0, self.stretch, rtol=_EXACT)
            )

        return np.reshape([at(float(speed)) for speed in np.ravel(speeds)], np.shape(speeds))


def law_of(youngs_modulus: float, poissons_ratio: float, density: float) -> Law:
    """The law from engineering constants; the ratio must be positive for it to turn convex."""
    E, nu = youngs_modulus, poissons_ratio
    return Law(E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu)), density)
