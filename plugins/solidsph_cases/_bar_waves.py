"""Linear waves in a bar: d'Alembert's solution with the reflections at both ends."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array

FREE = -1.0  # a wave that returns to a free end comes back with the other sign of its stress
HELD = 1.0  # and from one that is held with the same


@final
@attrs.frozen
class Pulse:
    """A pulse of unit height that begins at t = 0."""

    name: str
    duration: float  # [s]
    value: Callable[[Array], Array]  # at times [s]
    formula: str  # the same in the words of scenes
    integral_formula: str  # its integral from 0 to t [s]
    half_height: float  # when it first passes a half [s]


def smooth_pulse(duration: float) -> Pulse:
    """sin^2(pi t / duration): its slope is continuous."""
    T, t = f"{duration!r}", f"min(t, {duration!r})"

    def value(times: Array) -> Array:
        return np.asarray(np.sin(np.pi * np.clip(times, 0.0, duration) / duration) ** 2)

    integral = f"({t}/2 - {T}/(4*pi)*sin(2*pi*{t}/{T}))"
    return Pulse("smooth", duration, value, f"sin(pi*{t}/{T})**2", integral, 0.25 * duration)


def square_pulse(duration: float) -> Pulse:
    """1 for as long as it lasts."""

    def value(times: Array) -> Array:
        return np.asarray((times >= 0.0) & (times < duration), dtype=np.float64)

    formula, integral = f"(t < {duration!r})", f"min(t, {duration!r})"
    return Pulse("square", duration, value, formula, integral, 0.0)


@final
@attrs.frozen
class BarWaves:
    """Stress and velocity in a bar into which a pulse is sent at X = 0; X = length is fixed.

    T = f(t - X/c) + g(t + X/c) and v = (g - f) / (rho c). At the fixed end v = 0, so that
    g(s) = f(s - 2 L / c). At X = 0 the pulse p is either a traction, f + g = p, or a motion
    v = -p / (rho c), f - g = p; what returns is reflected as from a free or from a held end. So
    f(s) = p(s) + r p(s - 2 L / c) + r^2 p(s - 4 L / c) + ..., with r = -1 or 1.
    """

    length: float  # L [m]
    speed: float  # c [m/s]
    density: float  # rho [kg/m^3]
    stress_height: float  # of the pulse [Pa]
    pulse: Pulse
    left: float = FREE  # r, or HELD

    def stress(self, X: Array, times: Array) -> Array:
        """T11 [Pa] at places and times that broadcast."""
        return self._rightward(times - X / self.speed) + self._leftward(times + X / self.speed)

    def velocity(self, X: Array, times: Array) -> Array:
        """v [m/s] at places and times that broadcast."""
        rightward = self._rightward(times - X / self.speed)
        leftward = self._leftward(times + X / self.speed)
        return (leftward - rightward) / (self.density * self.speed)

    def _leftward(self, s: Array) -> Array:
        return self._rightward(s - 2.0 * self.length / self.speed)

    def _rightward(self, s: Array) -> Array:
        there_and_back = 2.0 * self.length / self.speed
        returns = max(0, ceil(float(np.max(s)) / there_and_back))
        terms = [
            self.left**k * self.pulse.value(s - k * there_and_back) for k in range(returns + 1)
        ]
        return np.asarray(self.stress_height * np.sum(terms, axis=0))
