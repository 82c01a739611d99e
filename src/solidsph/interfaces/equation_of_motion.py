"""Equation of motion: what an integrator asks of a scene, m a = f(t, x, v)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import attrs

from solidsph.interfaces.terms import Constraint, Load
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles

NOTHING: Mapping[str, Array] = MappingProxyType({})


@attrs.frozen(eq=False)
class Response:
    """What the scene answers to positions and velocities."""

    accelerations: Array  # (n, d) [m/s^2]
    applied: Mapping[str, Array]  # by account: force that it exerts on every particle, (n, d) [N]
    memory: Mapping[str, Array]  # what parts remember of the step, by names of theirs


@attrs.frozen(eq=False)
class EquationOfMotion(ABC):
    """The masses of a scene and what acts on them, besides the forces inside the bodies."""

    particles: Particles
    masses: Array  # (n,) [kg]
    constraints: Sequence[Constraint]
    loads: Sequence[Load]
    step_size: float  # of the run [s]

    @abstractmethod
    def place(self, time: float, positions: Array) -> Array:
        """Positions (n, d) with every imposed motion applied at `time` [s]."""

    @abstractmethod
    def carry(self, time: float, velocities: Array) -> Array:
        """Velocities (n, d) with every imposed motion applied at `time` [s]."""

    @abstractmethod
    def respond(
        self,
        time: float,
        positions: Array,
        velocities: Array,
        step: float = 0.0,
        memory: Mapping[str, Array] = NOTHING,
    ) -> Response:
        """Accelerations, and the force that each imposed part exerts on every particle.

        Call it once a step, at its end. Store `response.memory` in the state after the step.

        Args:
            time: at the end of the step [s].
            positions: there, (n, d) [m].
            velocities: there, (n, d) [m/s].
            step: its length [s].
            memory: `State.memory` before the step.
        """
