"""The paper's time integration."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.dynamics import Dynamics
from solidsph.interfaces.integrator import Integrator
from solidsph.particles import State

_INCREMENT = "central-difference increment"  # u_n - u_n-1 [m]


@final
@attrs.frozen
class CentralDifference(Integrator):
    """u_n+1 = dt^2 a_n + 2 u_n - u_n-1. Ismail & Reddy, eq. 18.

    Carried out on the increment u_n - u_n-1: the same numbers in exact arithmetic, but no digits
    are lost in the difference of near equals. The velocity shown is (u_n+1 - u_n-1) / (2 dt).
    """

    order: ClassVar[int] = 2
    stability_limit: ClassVar[float] = 2.0

    def start(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        response = dynamics.respond(state.time, state.positions, state.velocities)
        a = response.accelerations
        # u_-1 such that the velocity at the start is the one given.
        increment = step_size * state.velocities - 0.5 * step_size**2 * a
        return state.begun(
            accelerations=a, applied=response.applied, memory={_INCREMENT: increment}
        )

    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        time = state.time + step_size
        increment = state.memory[_INCREMENT] + step_size**2 * state.accelerations
        free = state.positions + increment
        positions = dynamics.place(time, free)
        # Only what was imposed: the difference of positions would bring their rounding back.
        increment = increment + (positions - free)
        backward = increment / step_size
        predicted = dynamics.carry(time, backward + 0.5 * step_size * state.accelerations)
        response = dynamics.respond(time, positions, predicted)
        velocities = backward + 0.5 * step_size * response.accelerations
        return state.advanced(
            time=time,
            positions=positions,
            velocities=dynamics.carry(time, velocities),
            accelerations=response.accelerations,
            applied=response.applied,
            memory={**state.memory, _INCREMENT: increment},
        )
