"""The velocity Verlet scheme."""

from __future__ import annotations

from typing import ClassVar, final

import attrs

from solidsph.dynamics import Dynamics
from solidsph.interfaces.integrator import Integrator
from solidsph.particles import State


@final
@attrs.frozen
class VelocityVerlet(Integrator):
    """Half a kick, a drift, half a kick. Swope et al. (1982).

    Forces that depend on velocity see the one predicted with the old acceleration.
    """

    order: ClassVar[int] = 2
    stability_limit: ClassVar[float] = 2.0

    def start(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        response = dynamics.respond(state.time, state.positions, state.velocities)
        return state.begun(accelerations=response.accelerations, applied=response.applied)

    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        time = state.time + step_size
        half = state.velocities + 0.5 * step_size * state.accelerations
        positions = dynamics.place(time, state.positions + step_size * half)
        predicted = dynamics.carry(time, half + 0.5 * step_size * state.accelerations)
        response = dynamics.respond(time, positions, predicted)
        return state.advanced(
            time=time,
            positions=positions,
            velocities=dynamics.carry(time, half + 0.5 * step_size * response.accelerations),
            accelerations=response.accelerations,
            applied=response.applied,
            memory=state.memory,
        )
