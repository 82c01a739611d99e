"""EquationOfMotion: m a = f(t, x, v), as an integrator sees a scene."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import attrs

from solidsph.interfaces.memory import NOTHING, Memory
from solidsph.interfaces.terms import Constraint, Load
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles


@attrs.frozen(eq=False)
class Response:
    """Accelerations and forces at given positions and velocities."""

    accelerations: Array  # (n, d) [m/s^2]
    applied: Mapping[str, Array]  # by account: force that it exerts on every particle, (n, d) [N]
    memory: Memory  # what parts remember of the step


@attrs.frozen(eq=False)
class EquationOfMotion(ABC):
    """Masses, constraints and loads of a scene; the internal forces of its bodies come on top."""

    particles: Particles
    masses: Array  # (n,) [kg]
    constraints: Sequence[Constraint]
    loads: Sequence[Load]
    step_size: float  # of the run [s]

    @abstractmethod
    def place(self, time: float, positions: Array) -> Array:
        """Positions (n, d) [m] with every imposed motion applied at `time` [s]."""

    @abstractmethod
    def carry(self, time: float, velocities: Array) -> Array:
        """Velocities (n, d) [m/s] with every imposed motion applied at `time` [s]."""

    @abstractmethod
    def respond(
        self,
        time: float,
        positions: Array,
        velocities: Array,
        step: float = 0.0,
        memory: Memory = NOTHING,
    ) -> Response:
        """Accelerations, and the force that each account exerts on every particle.

        Call it once per step, at its end. Store `response.memory` in the state after the step.

        Args:
            time: end of the step [s].
            positions: at that time, (n, d) [m].
            velocities: at that time, (n, d) [m/s].
            step: length of the step [s]; 0 if no step is made.
            memory: `State.memory` before the step.
        """
