"""Linear waves in a bar: d'Alembert's solution with the reflections at both ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import ceil
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.maths.arrays import Array

FREE = -1.0  # a wave that returns to a free end comes back with the other sign of its stress
HELD = 1.0  # and from one that is held with the same


class Pulse(ABC):
    """A pulse of unit height that begins at t = 0."""

    name: ClassVar[str]
    duration: float  # [s]

    @abstractmethod
    def value(self, times: Array) -> Array:
        """The pulse at `times` [s]."""

    @property
    @abstractmethod
    def formula(self) -> str:
        """The same in the words of scenes."""

    @property
    @abstractmethod
    def integral_formula(self) -> str:
        """Its integral from 0 to t in the words of scenes [s]."""

    @property
    @abstractmethod
    def half_height(self) -> float:
        """When it first passes a half [s]."""


@final
@attrs.frozen
class Smooth(Pulse):
    """sin^2(pi t / duration): its slope is continuous."""

    name: ClassVar[str] = "smooth"
    duration: float  # [s]

    def value(self, times: Array) -> Array:
        t = np.clip(times, 0.0, self.duration)
        return np.asarray(np.sin(np.pi * t / self.duration) ** 2)

    @property
    def formula(self) -> str:
        return f"sin(pi*min(t, {self.duration!r})/{self.duration!r})**2"

    @property
    def integral_formula(self) -> str:
        t = f"min(t, {self.duration!r})"
        return f"({t}/2 - {self.duration!r}/(4*pi)*sin(2*pi*{t}/{self.duration!r}))"

    @property
    def half_height(self) -> float:
        return 0.25 * self.duration


@final
@attrs.frozen
class Square(Pulse):
    """1 for as long as it lasts."""

    name: ClassVar[str] = "square"
    duration: float  # [s]

    def value(self, times: Array) -> Array:
        return np.asarray((times >= 0.0) & (times < self.duration), dtype=np.float64)

    @property
    def formula(self) -> str:
        return f"(t < {self.duration!r})"

    @property
    def integral_formula(self) -> str:
        return f"min(t, {self.duration!r})"

    @property
    def half_height(self) -> float:
        return 0.0


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
