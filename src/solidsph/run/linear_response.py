"""Linear response: how accelerations change with small deviations from a state."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.model.particles import State
from solidsph.run.dynamics import Dynamics

# Largest deviation in a difference [spacings]. One-sided differences are off by the same share, so
# it is as small as rounding allows; for sums in single precision that is a thousandth.
_DEVIATION = 1e-6
_ROUNDINGS = 3.0


@final
@attrs.frozen(eq=False)
class LinearResponse:
    """Stiffness over mass about a state at rest: all forces that depend on positions.

    It acts on deviations of the free components times the square root of their masses. So it is
    symmetric where the forces have an energy. An application is one evaluation of the forces.
    """

    dynamics: Dynamics
    state: State
    free: Mask  # (n, d) components that move freely, m in number
    roots: Array  # (m,) square roots of their masses [kg^0.5]
    deviation: Array = attrs.field(init=False)  # largest in a difference [m]
    unmoved: Array = attrs.field(init=False)  # (m,) accelerations in the state [m/s^2]

    @classmethod
    def about(cls, dynamics: Dynamics, state: State) -> LinearResponse:
        """The response about a state."""
        free = dynamics.free
        roots = np.sqrt(np.broadcast_to(dynamics.masses[:, None], free.shape)[free])
        return cls(dynamics, state, free, roots)

    @deviation.default
    def _least_deviation(self) -> float:
        part = max(_DEVIATION, _ROUNDINGS * float(np.sqrt(self.dynamics.internal.precision)))
        return part * float(self.dynamics.particles.spacings.min())

    @unmoved.default
    def _in_the_state(self) -> Array:
        return self._accelerations(np.zeros(len(self.roots)))

    def times(self, scaled: Array) -> Array:
        """The product with deviations times the roots of masses, (m,) [1/s^2 times theirs]."""
        direction = scaled / self.roots
        largest = float(np.abs(direction).max())
        if largest == 0.0:
            return np.zeros_like(scaled)
        share = self.deviation / largest
        change = self._accelerations(share * direction) - self.unmoved
        return -self.roots * change / share

    def shape(self, scaled: Array) -> Array:
        """The deviations (n, d) [m] of scaled ones (m,)."""
        shape = np.zeros(self.free.shape)
        shape[self.free] = scaled / self.roots
        return shape

    def scaled(self, shape: Array) -> Array:
        """The scaled deviations (m,) of deviations (n, d) [m]."""
        values: Array = shape[self.free] * self.roots
        return values

    def _accelerations(self, deviations: Array) -> Array:
        time, rest = self.state.time, np.zeros(self.free.shape)
        moved = self.dynamics.place(time, self.state.positions).copy()
        moved[self.free] += deviations
        placed = self.dynamics.place(time, moved)
        with np.errstate(all="ignore"):  # the caller sees what is not finite
            response = self.dynamics.respond(time, placed, rest, memory=self.state.memory)
        values: Array = response.accelerations[self.free]
        return values
