"""An integrator that keeps its promises, and others that each break one of them."""

from __future__ import annotations

from typing import ClassVar

import attrs

from solidsph import (
    Integrator,
    State,
)
from solidsph.run.dynamics import Dynamics
from solidsph_builtin.integrators.velocity_verlet import VelocityVerlet


@attrs.frozen
class GoodIntegrator(Integrator):
    """Symplectic Euler, of the first order."""

    order: ClassVar[int] = 1
    stability_limit: ClassVar[float] = 2.0

    def start(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        response = dynamics.respond(state.time, state.positions, state.velocities)
        return attrs.evolve(
            state,
            accelerations=response.accelerations,
            applied=response.applied,
            work=dict.fromkeys(response.applied, 0.0),
        )

    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        time = state.time + step_size
        velocities = dynamics.carry(time, state.velocities + step_size * state.accelerations)
        positions = dynamics.place(time, state.positions + step_size * velocities)
        response = dynamics.respond(time, positions, velocities)
        return state.advanced(
            time=time,
            positions=positions,
            velocities=velocities,
            accelerations=response.accelerations,
            applied=response.applied,
            memory=state.memory,
        )


class FirstOrderClaimingSecond(GoodIntegrator):
    order: ClassVar[int] = 2


class LimitTooHigh(GoodIntegrator):
    stability_limit: ClassVar[float] = 2.1


class LimitTooModest(GoodIntegrator):
    stability_limit: ClassVar[float] = 1.5


class NoMotionImposed(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        return super().advance(state, attrs.evolve(dynamics, constraints=[]), step_size)


class NoWork(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        return attrs.evolve(super().advance(state, dynamics, step_size), work=state.work)


class InPlace(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        after = super().advance(state, dynamics, step_size)
        state.positions[:] = after.positions
        return attrs.evolve(after, positions=state.positions)


class TimeStandsStill(GoodIntegrator):
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        return attrs.evolve(super().advance(state, dynamics, step_size), time=state.time)


class DampedByOldVelocity(GoodIntegrator):
    """Velocity Verlet, but forces see the velocity at half a step."""

    order: ClassVar[int] = 2

    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        time = state.time + step_size
        half = state.velocities + 0.5 * step_size * state.accelerations
        positions = dynamics.place(time, state.positions + step_size * half)
        response = dynamics.respond(time, positions, half)
        return state.advanced(
            time=time,
            positions=positions,
            velocities=dynamics.carry(time, half + 0.5 * step_size * response.accelerations),
            accelerations=response.accelerations,
            applied=response.applied,
            memory=state.memory,
        )


class StableByTheSum(VelocityVerlet):
    """As if velocities came without delay: twice as much as strong damping bears."""

    def stable_step(self, frequency: float, damping: float) -> float:
        return self.stability_limit / (frequency + damping)


INTEGRATORS = [
    (FirstOrderClaimingSecond, {"order", "order with damping"}),
    (LimitTooHigh, {"stable below limit"}),
    (StableByTheSum, {"stable with damping"}),
    (LimitTooModest, {"unstable above limit"}),
    (NoMotionImposed, {"imposed motion"}),
    (NoWork, {"work of loads"}),
    (InPlace, {"bookkeeping"}),
    (TimeStandsStill, {"bookkeeping"}),
    (DampedByOldVelocity, {"order with damping"}),
]
