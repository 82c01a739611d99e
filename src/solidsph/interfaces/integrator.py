"""Integrator: how the state advances over one time step."""

from __future__ import annotations

from abc import abstractmethod
from math import sqrt
from typing import ClassVar

from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.part import Part
from solidsph.maths.arrays import Scalar
from solidsph.model.particles import State

MEAN_VELOCITY = "mean velocity of the step"
"""Name in `memory` of the velocities (u_n - u_n-1) / dt of a pointwise integrator, (n, d) [m/s]."""


class Integrator(Part):
    """An explicit scheme with one evaluation of the forces per step."""

    order: ClassVar[int]
    """Order of accuracy in the time step: halving it divides the error by 2^order."""

    stability_limit: ClassVar[float]
    """Largest stable product of the time step and the highest angular frequency [-]."""

    def stable_step(self, frequency: float, damping: float) -> float:
        """Largest stable step [s] of vibrations up to an angular `frequency` [rad/s], damped at a
        rate of up to `damping` [1/s]; infinite if both are zero.

        Forces that depend on velocities get that which the last acceleration predicts. With a limit
        of 2 that is stable where (w dt)^2 / 4 + c dt is at most 1, for the frequency w and the rate
        c of -c v: at half the step of a damper without that delay.
        """
        total = damping + sqrt(damping**2 + frequency**2)
        return self.stability_limit / total if total > 0.0 else float("inf")

    @abstractmethod
    def start(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The first state, with accelerations and what the scheme keeps in `memory`.

        A run whose step is cut begins again at a state in the middle: forces follow from what the
        parts keep in its `memory`, which must not be lost.
        """

    @abstractmethod
    def advance(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The state one time step [s] later."""


class PointwiseIntegrator(Integrator):
    """A scheme given by two formulas for each component of the motion of a particle.

    A step moves every particle by dt h with a mean velocity h, evaluates the accelerations at the
    new positions, and obtains the new velocity from both. The formulas are pure pointwise functions
    of numbers or arrays, so that an engine can carry out whole steps by itself.
    """

    @staticmethod
    @abstractmethod
    def mean_velocity(
        velocity: Scalar, acceleration: Scalar, last: Scalar, step_size: float
    ) -> Scalar:
        """Mean velocity h of a step [m/s], from the state at its beginning.

        Args:
            velocity: [m/s].
            acceleration: [m/s^2].
            last: mean velocity of the step before [m/s].
            step_size: dt [s].
        """

    @staticmethod
    @abstractmethod
    def end_velocity(mean_velocity: Scalar, acceleration: Scalar, step_size: float) -> Scalar:
        """Velocity at the end of a step [m/s], from h and the acceleration at its end.

        With the acceleration at its beginning it predicts the velocity that the forces depend on.
        """

    def start(self, state: State, dynamics: EquationOfMotion, step_size: float) -> State:
        """The first state; the mean velocity before it is the one that leads to its velocity."""
        # A run whose step is cut begins again in the middle, with all that its parts remember.
        response = dynamics.respond(
            state.time, state.positions, state.velocities, memory=state.memory
        )
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
        # Only what was imposed: a difference of positions would carry their rounding.
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
