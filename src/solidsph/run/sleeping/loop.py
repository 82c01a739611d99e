"""SleepingLoop: steps of those particles alone that move, or will move before the next look."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.compilable_terms import ScheduledConstraint, ScheduledLoad
from solidsph.interfaces.integrator import MEAN_VELOCITY, Integrator, PointwiseIntegrator
from solidsph.interfaces.subset import Subset
from solidsph.interfaces.terms import Load
from solidsph.interfaces.time_loop import StepError, TimeLoop
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import State
from solidsph.run.dynamics import Dynamics
from solidsph.run.sleeping.frozen import ASLEEP, Frozen
from solidsph.run.sleeping.slabs import Slabs
from solidsph.run.stable_step import lattice_frequency
from solidsph.run.step_by_step import steps_of

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene

# Part of a slab that the fastest wave may cross before it is looked again who is awake.
_CROSSED = 0.5

# Ahead of a front the discrete motion falls off by some powers of ten in a few spacings: so many
# more are awake. With 8 a front that a wall pushes without warning is right to 1e-12.
_PRECURSOR = 12.0

# Of a position, in parts of it, times a few for the sums that it goes into.
_ROUNDING = 4.0 * np.finfo(np.float64).eps

_LARGEST = "sleep: largest speed"
"""Where the largest speed so far is in `State.memory`, (1,) [m/s]."""


def check_sleep(simulation: BuiltScene) -> None:
    """Raise SceneError if a part of the scene cannot sleep."""
    dynamics = simulation.dynamics
    none = np.empty(0, dtype=np.intp)
    if dynamics.internal.part(none) is None:
        raise SceneError(
            f"sleep: {type(dynamics.internal).__name__} cannot form the forces of some particles "
            "alone; use one body of the total Lagrangian form whose material has no history, "
            "without ghosts, or leave [sleep] out"
        )
    nobody, free = (
        Subset.of(none, dynamics.particles.count),
        np.zeros(dynamics.particles.count, bool),
    )
    parts = [(one, one.part(nobody, free)) for one in dynamics.constraints]
    for term, part in (*parts, *((one, one.part(nobody)) for one in dynamics.loads)):
        if part is None:
            raise SceneError(
                f"sleep: {term.label!r} does not say what it depends on particle by particle, so "
                "that it cannot act on those alone that are awake; leave out it, or [sleep]"
            )
    if not isinstance(simulation.integrator, PointwiseIntegrator):
        raise SceneError(
            f"sleep: integrator {type(simulation.integrator).__name__} may need more of a particle "
            "than its velocity and acceleration; use 'velocity-verlet', or leave [sleep] out"
        )


def sleeping_loop(simulation: BuiltScene) -> SleepingLoop:
    """The loop of a scene with [sleep]."""
    wanted = simulation.scene.sleep
    assert wanted is not None
    check_sleep(simulation)
    (body,) = simulation.model.bodies
    slabs = Slabs.across(simulation.particles, wanted.slabs)
    supports = max((one.supports for one in simulation.dynamics.loads), default=Load.supports)
    fastest = body.material.wave_speed * simulation.step_size
    steps = max(1, int(_CROSSED * slabs.width / fastest))
    spacing = float(body.particles.spacings.max())
    return SleepingLoop(
        body=body,
        dynamics=simulation.dynamics,
        integrator=simulation.integrator,
        slabs=slabs,
        tolerance=wanted.tolerance,
        steps_at_once=steps,
        reach=steps * fastest + _PRECURSOR * spacing,
        highest=lattice_frequency([body]),
        halo=supports * body.smoothing.support_radius,
    )


@attrs.frozen(eq=False)
class _Window:
    """What is awake, made ready to be stepped."""

    awake: Mask  # slabs
    chosen: Subset  # particles that are awake, or near those
    moving: Indices  # those of the chosen that are awake
    dynamics: Dynamics
    loop: TimeLoop


@final
@attrs.define(eq=False)
class SleepingLoop(TimeLoop):
    """Steps of some slabs of the body; all others stay where they are.

    A slab sleeps while its particles are slower than a part `tolerance` of the largest speed so
    far, would not exceed that by their accelerations before the next look, and nothing imposed on
    them changes. It wakes before a wave, and what runs ahead of it, can have reached it.
    """

    body: Body
    dynamics: Dynamics
    integrator: Integrator
    slabs: Slabs
    tolerance: float
    steps_at_once: int
    reach: float  # from what moves to what is still awake [m]
    highest: float  # angular frequency of the shortest waves [rad/s]
    halo: float  # [m]
    awake_steps: int = 0  # of particles, in all
    all_steps: int = 0
    _window: _Window | None = None  # the last one: what is awake often stays awake

    @property
    def effort(self) -> Mapping[str, Any]:
        return {"awake [-]": self.awake_steps / max(1, self.all_steps)}

    def advance(self, state: State, stop: int) -> State:
        full = _Arrays.of(state)
        while full.step < stop:
            count = min(self.steps_at_once, stop - full.step)
            awake = self._awake(full, count)
            window = self._prepared(awake, full)
            self.awake_steps += count * len(window.moving)
            self.all_steps += count * self.dynamics.particles.count
            full.settle(window.moving, window.chosen)
            try:
                after = window.loop.advance(full.part(window.chosen), full.step + count)
            except StepError as failed:
                full.take(window.chosen, window.moving, failed.state)
                raise StepError(full.state(), failed.cause) from failed
            full.take(window.chosen, window.moving, after)
        return full.state()

    def _awake(self, full: _Arrays, count: int) -> Mask:
        """Slabs that are to be stepped."""
        speeds = self.slabs.largest(np.einsum("ni,ni->n", full.v, full.v))
        gains = self.slabs.largest(np.einsum("ni,ni->n", full.a, full.a))
        full.largest = max(full.largest, float(speeds.max()))
        limit = self.tolerance * full.largest
        # A displacement is the difference of two positions: what its rounding makes of the forces
        # is no motion to come.
        rounding = _ROUNDING * self.highest**2 * float(np.abs(full.x).max())
        moving = (speeds > limit) | (gains > limit / (count * self.dynamics.step_size) + rounding)
        moving |= self._driven(full.time, count)
        return self.slabs.widened(moving, self.reach)

    def _driven(self, time: float, count: int) -> Mask:
        """Slabs on which something that is imposed changes in the next steps."""
        found = np.zeros(self.slabs.count, dtype=np.bool_)
        times = time + self.dynamics.step_size * np.arange(count + 1, dtype=np.float64)
        for motion in self.dynamics.constraints:
            assert isinstance(motion, ScheduledConstraint)
            values = motion.schedule(times, 0)
            found |= self.slabs.marked(motion.entries[0][np.ptp(values, axis=0) > 0.0])
        for load in self.dynamics.loads:
            if isinstance(load, ScheduledLoad):
                changes = np.ptp(load.schedule(times), axis=0).max(axis=1) > 0.0
                found |= self.slabs.marked(load.particles[changes])
        return found

    def _prepared(self, awake: Mask, full: _Arrays) -> _Window:
        if self._window is None or not np.array_equal(awake, self._window.awake):
            self._window = self._made(awake, full)
        return self._window

    def _made(self, awake: Mask, full: _Arrays) -> _Window:
        whole, slabs = self.dynamics, self.slabs
        near = slabs.widened(awake, self.halo)
        chosen = Subset.of(np.flatnonzero(near[slabs.of]), whole.particles.count)
        asleep = ~awake[slabs.of]
        moving = np.flatnonzero(~asleep[chosen.particles])
        internal = whole.internal.part(chosen.particles)
        assert internal is not None, "`check_sleep` has refused it"
        still = np.flatnonzero(asleep[chosen.particles])
        u = full.x[chosen.particles] - whole.particles.positions[chosen.particles]
        constraints = [one.part(chosen, asleep) for one in whole.constraints]
        loads = [one.part(chosen) for one in whole.loads]
        dynamics = Dynamics(
            particles=part_of(self.body, chosen.particles).particles,
            masses=whole.masses[chosen.particles],
            internal=internal,
            constraints=[Frozen.of(still, u), *(one for one in constraints if one is not None)],
            loads=[one for one in loads if one is not None],
            step_size=whole.step_size,
        )
        loop = steps_of(dynamics, self.integrator)
        return _Window(awake, chosen, moving, dynamics, loop)


@attrs.define(eq=False)
class _Arrays:
    """A state whose arrays may be written on."""

    time: float
    step: int
    x: Array
    v: Array
    a: Array
    h: Array
    largest: float
    memory: Mapping[str, Array]
    applied: dict[str, Array]
    work: Mapping[str, float]

    @classmethod
    def of(cls, state: State) -> _Arrays:
        return cls(
            time=state.time,
            step=state.step,
            x=state.positions.copy(),
            v=state.velocities.copy(),
            a=state.accelerations.copy(),
            h=state.memory[MEAN_VELOCITY].copy(),
            largest=float(state.memory.get(_LARGEST, np.zeros(1))[0]),
            memory=state.memory,
            applied={name: force.copy() for name, force in state.applied.items()},
            work=state.work,
        )

    def settle(self, moving: Indices, chosen: Subset) -> None:
        """Let all that sleeps be at rest."""
        asleep = np.ones(len(self.x), dtype=np.bool_)
        asleep[chosen.particles[moving]] = False
        for one in (self.v, self.a, self.h):
            one[asleep] = 0.0

    def part(self, chosen: Subset) -> State:
        """The state of the chosen."""
        own = chosen.particles
        applied = {name: force[own] for name, force in self.applied.items()}
        return State(
            time=self.time,
            step=self.step,
            positions=self.x[own],
            velocities=self.v[own],
            accelerations=self.a[own],
            memory={MEAN_VELOCITY: self.h[own]},
            applied={**applied, ASLEEP: np.zeros((len(own), self.x.shape[1]))},
            work={**self.work, ASLEEP: 0.0},
        )

    def take(self, chosen: Subset, moving: Indices, after: State) -> None:
        """Take back what those that are awake have done."""
        own = chosen.particles[moving]
        self.time, self.step = after.time, after.step
        for mine, theirs in (
            (self.x, after.positions),
            (self.v, after.velocities),
            (self.a, after.accelerations),
            (self.h, after.memory[MEAN_VELOCITY]),
            *((self.applied[name], after.applied[name]) for name in self.applied),
        ):
            mine[own] = theirs[moving]
        self.work = {name: value for name, value in after.work.items() if name != ASLEEP}

    def state(self) -> State:
        """All of it."""
        memory = {
            **self.memory,
            MEAN_VELOCITY: self.h,
            _LARGEST: np.array([self.largest]),
        }
        return State(
            time=self.time,
            step=self.step,
            positions=self.x,
            velocities=self.v,
            accelerations=self.a,
            memory=memory,
            applied=self.applied,
            work=self.work,
        )
