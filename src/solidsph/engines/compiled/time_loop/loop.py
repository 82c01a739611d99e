"""The compiled time loop: whole steps between two outputs as one compiled function."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, final

import attrs
import numpy as np
from numba import prange, types

from solidsph.engines.array_law import ArrayLaw
from solidsph.engines.compiled.constants import PER_PARTICLE
from solidsph.engines.compiled.fixed.partition import thread_count
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pointwise import NotCompilableError, compiled_function
from solidsph.engines.compiled.time_loop.accounts import Accounts
from solidsph.engines.compiled.time_loop.call_each import call_each
from solidsph.engines.compiled.time_loop.constraints import ConstraintCalls, constraint_calls
from solidsph.engines.compiled.time_loop.internal_forces import Internal, internal_forces
from solidsph.engines.compiled.time_loop.loads import Call, CompiledLoad, Setting, compiled_load
from solidsph.engines.compiled.time_loop.merged import merged_load
from solidsph.errors import BuildError
from solidsph.interfaces.compilable_terms import (
    LinearExtension,
    ScheduledConstraint,
    ScheduledLoad,
)
from solidsph.interfaces.deformation_load import DeformationLoad
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.integrator import MEAN_VELOCITY, Integrator, PointwiseIntegrator
from solidsph.interfaces.law import memory_name
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.terms import StressTerm
from solidsph.interfaces.time_loop import NOT_FINITE, StepError, TimeLoop
from solidsph.maths.arrays import Array
from solidsph.model.particles import State

if TYPE_CHECKING:
    from solidsph.engines.compiled.fixed.body import ReferenceBody

# Largest number of entries in the tables of scheduled values, for the steps that go together.
_TABLE = 1 << 18

# Largest number of operations of about a nanosecond in these steps: interruptions wait for them.
_AT_ONCE = 3e8


class _Moving(NamedTuple):
    """Arrays that evolve, each (n, d)."""

    u: Array  # displacement [m]
    v: Array  # velocity [m/s]
    a: Array  # acceleration [m/s^2]
    h: Array  # mean velocity of the last step [m/s]
    path: Array  # displacement in the last step [m]
    total: Array  # force [N]


def are_compilable(
    bodies: Sequence[ReferenceBody],
    conditions: Sequence[StressTerm],
    equation: EquationOfMotion,
    integrator: Integrator,
) -> bool:
    """True if all in a step but loads is of a compilable kind."""
    labels = [c.label for c in (*equation.loads, *equation.constraints)]
    remember = any(body.remembers for body in bodies)
    ghosts = any(body.body.particles.ghosts.any() for body in bodies)
    fused = not conditions and all(body.fused for body in bodies)
    fused &= not (remember and ghosts)  # ghosts have no rows, and would forget
    extended = all(isinstance(term, LinearExtension) for term in conditions)
    alone = len(bodies) == 1 and extended and not remember
    alone &= not any(body.filters for body in bodies)
    return (
        isinstance(integrator, PointwiseIntegrator)
        and (fused or alone)
        and all(labels.count(load.label) == 1 for load in equation.loads)
        and all(
            isinstance(term, (ScheduledConstraint, LinearExtension))
            for term in equation.constraints
        )
    )


def compiled_loop(
    bodies: Sequence[ReferenceBody],
    conditions: Sequence[StressTerm],
    sums: InternalForces,
    equation: EquationOfMotion,
    integrator: Integrator,
) -> TimeLoop:
    """The time loop for prepared bodies, conditions on their stress, and an equation of motion.

    `sums` are the forces of the same bodies, one evaluation at a time.

    A load that does not compile is called between the halves of every step.

    Raises:
        NotCompilableError: another part is not of a compilable kind, or does not compile.
    """
    if not isinstance(integrator, PointwiseIntegrator):
        raise NotCompilableError(f"integrator {type(integrator).__name__} is not pointwise")
    particles = equation.particles
    d = particles.dimension
    threads = thread_count(PER_PARTICLE * particles.count)  # for loops over particles
    for body in bodies:
        body.gradient_partition.check()
    merged = merged_load(equation.loads, bodies, conditions, equation.step_size)
    internal = internal_forces(bodies, conditions, equation.step_size, merged)
    setting = Setting(particles.positions, bodies, threads > 1)
    loads = [compiled_load(load, setting, merged) for load in equation.loads]
    calls = [constraint_calls(motion, d) for motion in equation.constraints]
    by_call = [tuple(call[k] for call in calls) for k in range(len(ConstraintCalls._fields))]
    steps = _steps(
        d,
        threads > 1,
        compiled_function(integrator.mean_velocity, *[types.float64] * 4),
        compiled_function(integrator.end_velocity, *[types.float64] * 3),
        internal.forces,
        call_each(tuple(load.apply for load in loads)),
        ConstraintCalls(*(call_each(functions) for functions in by_call)),
    )
    return CompiledLoop(sums, equation, internal, loads, steps, threads)


@final
@attrs.frozen(eq=False)
class CompiledLoop(TimeLoop):
    """Steps by one compiled function."""

    sums: InternalForces
    equation: EquationOfMotion
    internal: Internal
    loads: Sequence[CompiledLoad]
    steps: _Steps
    threads: int
    most_steps: int = attrs.field(init=False)  # that share one set of tables

    @most_steps.default
    def _within_memory(self) -> int:
        two = np.array([0.0, self.equation.step_size])
        parts = [load.schedule(two) for load in self._scheduled_loads]
        parts += [
            motion.schedule(two, k, self.equation.step_size)
            for motion in self._scheduled_motions
            for k in range(3)
        ]
        width = sum(int(part[0].size) for part in parts if len(part) > 1)
        work = PER_PARTICLE * self.equation.particles.count + 2 * self.sums.pair_count
        return max(1, min(_TABLE // max(1, width), int(_AT_ONCE / work)))

    @property
    def _scheduled_loads(self) -> Sequence[ScheduledLoad | DeformationLoad]:
        return [c for c in self.equation.loads if isinstance(c, ScheduledLoad | DeformationLoad)]

    @property
    def _scheduled_motions(self) -> Sequence[ScheduledConstraint]:
        return [c for c in self.equation.constraints if isinstance(c, ScheduledConstraint)]

    def advance(self, state: State, stop: int) -> State:
        equation, X = self.equation, self.equation.particles.positions
        moving = _Moving(
            u=state.positions - X,
            v=state.velocities.copy(),
            a=state.accelerations.copy(),
            h=state.memory[MEAN_VELOCITY].copy(),
            path=np.zeros_like(X),
            total=np.zeros_like(X),
        )
        # Ghosts have no mass, and no equation of motion.
        inverse_masses = np.zeros_like(equation.masses)
        np.divide(1.0, equation.masses, out=inverse_masses, where=equation.masses > 0.0)
        accounts = Accounts.of(self.sums, equation, state)
        for body, history in self.internal.histories:
            history[...] = ArrayLaw(body).history_of(state.memory)
        merged = [one.merged for one in self.loads if one.merged is not None]
        done, memory = 0, state.memory
        while state.step + done < stop:
            count = min(stop - state.step - done, self.most_steps)
            numbers = np.arange(done + 1, done + count + 1, dtype=np.float64)
            times = state.time + self.equation.step_size * numbers
            loads = accounts.loads([one.own(times) for one in self.loads], self.threads)
            motions = accounts.motions(times)
            data = equation.masses, inverse_masses, self.internal.data, loads, motions
            before = moving.u.copy()
            for one in merged:
                one.begin(before)
            if self._calls:
                try:
                    # Overflow and invalid values show in the accelerations.
                    with np.errstate(all="ignore"):
                        carried_out, memory = self._by_calls(times, moving, data, memory)
                except BuildError as cause:  # a load cannot form its forces any longer
                    raise StepError(state, cause.problems[0]) from cause
            else:
                dt = self.equation.step_size
                carried_out = self.steps.all(count, dt, self.threads, moving, *data)
            done += carried_out
            accounts.settle(loads, motions)
            accounts.settle_merged(merged, before, moving.u)
            if not np.isfinite(moving.a.sum()):
                break
        time = state.time + self.equation.step_size * done
        end = State(
            time=time,
            step=state.step + done,
            positions=X + moving.u,
            velocities=moving.v,
            accelerations=moving.a,
            applied=accounts.applied(time, moving.u),
            work=accounts.work,
            memory={
                **memory,
                **{memory_name(body): own.copy() for body, own in self.internal.histories},
                MEAN_VELOCITY: moving.h,
            },
        )
        if not np.isfinite(moving.a.sum()):
            raise StepError(end, NOT_FINITE)
        return end

    @property
    def _calls(self) -> Sequence[Call]:
        return [one.called for one in self.loads if one.called is not None]

    def _by_calls(
        self, times: Array, moving: _Moving, data: tuple[Any, ...], memory: Memory
    ) -> tuple[int, Memory]:
        """Steps that end at `times` (t,) [s], with calls of loads between their halves: how many
        were made, and what the loads remember."""
        X, dt, threads = self.equation.particles.positions, self.equation.step_size, self.threads
        calls, (*_, motions) = self._calls, data
        for step, time in enumerate(times.tolist()):
            self.steps.begin(step, dt, threads, moving, motions)
            positions, velocities = X + moving.u, moving.v.copy()  # for whoever keeps them
            now = dict(memory)
            for load, forces in calls:
                forces[...], changed = load.advance(time, dt, positions, velocities, memory)
                now |= changed
            memory = now
            if not self.steps.end(step, dt, threads, moving, *data):
                return step + 1, memory
        return len(times), memory


class _Steps(NamedTuple):
    """Compiled steps, whole or in halves; `data` are (masses, 1/masses, bodies, loads, motions)."""

    begin: Any  # (step, dt, threads, moving, motions): to the positions at the end of the step
    end: Any  # (step, dt, threads, moving, *data) -> True if all accelerations are finite
    all: Any  # (count, dt, threads, moving, *data) -> steps made, up to one that is not finite


@cache
def _steps(
    dimension: int,
    threaded: bool,
    mean_velocity: Any,
    end_velocity: Any,
    internal: Any,
    loads: Any,
    motion: ConstraintCalls,
) -> _Steps:
    move, hand_on, react = motion

    @njit(parallel=threaded)
    def drift(threads, dt, moving):
        u, v, a, h, path, _ = moving
        n = len(u)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(dimension):
                    mean = mean_velocity(v[p, i], a[p, i], h[p, i], dt)
                    h[p, i] = mean
                    path[p, i] = dt * mean
                    u[p, i] += dt * mean
                    v[p, i] = end_velocity(mean, a[p, i], dt)

    @njit(parallel=threaded)
    def kick(threads, dt, moving, inverse_masses):
        _, v, a, h, _, total = moving
        n = len(v)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(dimension):
                    a[p, i] = total[p, i] * inverse_masses[p]
                    v[p, i] = end_velocity(h[p, i], a[p, i], dt)

    @njit
    def begin(step, dt, threads, moving, motion_parts):
        u, v, _, h, path, _ = moving
        drift(threads, dt, moving)
        move(motion_parts, step, dt, u, h, path, v)

    @njit
    def end(step, dt, threads, moving, masses, inverse_masses, bodies, load_parts, motion_parts):
        u, v, a, _, path, total = moving
        internal(bodies, u, v, total)
        loads(load_parts, step, u, v, path, total)
        hand_on(motion_parts, total)
        kick(threads, dt, moving, inverse_masses)
        react(motion_parts, step, masses, total, path, a, v)
        return np.isfinite(a.sum())

    @njit
    def steps(count, dt, threads, moving, masses, inverse_masses, bodies, load_parts, motion_parts):
        for step in range(count):
            begin(step, dt, threads, moving, motion_parts)
            data = masses, inverse_masses, bodies, load_parts, motion_parts
            if not end(step, dt, threads, moving, *data):
                return step + 1
        return count

    return _Steps(begin, end, steps)
