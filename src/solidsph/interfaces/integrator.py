"""Integrator: how State advances over one time step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.maths.arrays import Scalar
from solidsph.model.particles import State

MEAN_VELOCITY = "mean velocity of the step"
"""What a pointwise integrator keeps in `memory`: (u_n - u_n-1) / dt of every particle [m/s]."""


class Integrator(ABC):
    """An explicit scheme with one evaluation of the forces a step."""

    order: ClassVar[int]
    """Order of accuracy in the time step: halving it divides the error by 2^order."""

    stability_limit: ClassVar[float]
    """Largest stable product of the time step and the highest angular frequency [-]."""

    @abstractmethod
    def start(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The first state, with accelerations and whatever the scheme keeps in `memory`."""

    @abstractmethod
    def advance(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The state one time step [s] later."""


class PointwiseIntegrator(Integrator):
    """A scheme that is two formulas for each component of each particle's motion.

    A step moves every particle by dt h with a mean velocity h, finds the accelerations where it
    arrives, and from both the velocity there. The formulas are pure pointwise functions of numbers
    or arrays, so an engine can carry out whole steps by itself.
    """

    @staticmethod
    @abstractmethod
    def mean_velocity(
        velocity: Scalar, acceleration: Scalar, last: Scalar, step_size: float
    ) -> Scalar:
        """h, from what holds before the step; `last` is the h of the step before [m/s]."""

    @staticmethod
    @abstractmethod
    def end_velocity(mean_velocity: Scalar, acceleration: Scalar, step_size: float) -> Scalar:
        """Velocity at the end of the step [m/s], from h and the acceleration there.

        With the acceleration before the step it is the velocity that forces see.
        """

    def start(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The first state: the step before it is one that would have led to its velocity."""
        response = dynamics.respond(state.time, state.positions, state.velocities)
        a = response.accelerations
        return state.begun(
            accelerations=a,
            applied=response.applied,
            memory={**response.memory, MEAN_VELOCITY: state.velocities - 0.5 * step_size * a},
        )

    def advance(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The state one time step [s] later."""
        time = state.time + step_size
        a = state.accelerations
        h = self.mean_velocity(state.velocities, a, state.memory[MEAN_VELOCITY], step_size)
        free = state.positions + step_size * h
        positions = dynamics.place(time, free)
        # Only what was imposed: the difference of positions would bring their rounding back.
        h = h + (positions - free) / step_size
        predicted = dynamics.carry(time, self.end_velocity(h, a, step_size))
        response = dynamics.respond(time, positions, predicted, step_size, state.memory)
        return state.advanced(
            time=time,
            positions=positions,
            velocities=dynamics.carry(
                time, self.end_velocity(h, response.accelerations, step_size)
            ),
            accelerations=response.accelerations,
            applied=response.applied,
            memory={**state.memory, **response.memory, MEAN_VELOCITY: h},
        )
