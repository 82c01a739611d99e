"""SleepingLoop: time loop that steps only regions that move or will soon move."""

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
from solidsph.maths.arrays import Indices, Mask
from solidsph.model.particles import State
from solidsph.run.cfl_step import lattice_frequency
from solidsph.run.dynamics import Dynamics
from solidsph.run.sleeping.frozen import ASLEEP, Frozen
from solidsph.run.sleeping.slabs import Slabs
from solidsph.run.step_by_step import steps_of

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene

# Fraction of a slab that the fastest wave may cross between two searches for moving slabs.
_CROSSED = 0.5

# Spacings kept awake ahead of a front, where the discrete motion decays by several powers of ten.
# With 8, the front of a sudden push by a wall is accurate to 1e-12.
_PRECURSOR = 12.0

# Relative rounding error of a position, with a factor for the sums that it enters.
_ROUNDING = 4.0 * np.finfo(np.float64).eps

_LARGEST = "sleep: largest speed"
"""Key of the largest speed so far in `State.memory`, (1,) [m/s]."""


def check_sleep(simulation: BuiltScene) -> None:
    """Raise SceneError if a part of the scene cannot sleep."""
    dynamics = simulation.dynamics
    count = dynamics.particles.count
    if dynamics.internal.part(np.empty(0, dtype=np.intp)) is None:
        raise SceneError(
            f"sleep: {type(dynamics.internal).__name__} cannot form the forces of some particles "
            "alone; use one body of the total Lagrangian form, without filter_above, whose "
            "material has no history, without ghosts, or leave [sleep] out"
        )
    empty, awake = Subset.of(np.empty(0, dtype=np.intp), count), np.zeros(count, bool)
    constraints = [(term, term.part(empty, awake)) for term in dynamics.constraints]
    for term, part in (*constraints, *((load, load.part(empty)) for load in dynamics.loads)):
        if part is None:
            raise SceneError(
                f"sleep: {term.label!r} cannot be restricted to awake particles; leave it out, or "
                "leave out [sleep]"
            )
    if not isinstance(simulation.integrator, PointwiseIntegrator):
        raise SceneError(
            f"sleep: integrator {type(simulation.integrator).__name__} may depend on more than the "
            "velocity and acceleration of a particle; use 'velocity-verlet', or leave out [sleep]"
        )


def sleeping_loop(simulation: BuiltScene) -> SleepingLoop:
    """Loop of a scene with [sleep]."""
    wanted = simulation.scene.sleep
    assert wanted is not None
    check_sleep(simulation)
    (body,) = simulation.model.bodies
    slabs = Slabs.across(simulation.particles, wanted.slabs)
    supports = max((load.supports for load in simulation.dynamics.loads), default=Load.supports)
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
    """Awake slabs with the dynamics and the loop that step them."""

    awake: Mask  # slabs
    chosen: Subset  # awake particles and those near them
    moving: Indices  # awake particles among the chosen
    dynamics: Dynamics
    loop: TimeLoop

    @property
    def awake_particles(self) -> Indices:
        """Awake particles among all."""
        return self.chosen.particles[self.moving]


@final
@attrs.define(eq=False)
class SleepingLoop(TimeLoop):
    """Time loop that steps the awake slabs of the body and holds all others in place.

    A slab sleeps while its particles are slower than `tolerance` times the largest speed so far,
    their accelerations would not take them beyond that before the next search, and no imposed
    motion or load on them changes. It is woken before a wave or its precursor can reach it.
    """

    body: Body
    dynamics: Dynamics
    integrator: Integrator
    slabs: Slabs
    tolerance: float
    steps_at_once: int
    reach: float  # distance from moving particles up to which slabs are awake [m]
    highest: float  # angular frequency of the shortest waves [rad/s]
    halo: float  # distance up to which sleeping neighbours are included [m]
    awake_steps: int = 0  # particle steps carried out
    all_steps: int = 0
    _window: _Window | None = None  # the last one, reused while the same slabs are awake

    @property
    def effort(self) -> Mapping[str, Any]:
        return {"awake [-]": self.awake_steps / max(1, self.all_steps)}

    def advance(self, state: State, stop: int) -> State:
        full = _writable(state)
        while full.step < stop:
            count = min(self.steps_at_once, stop - full.step)
            awake = self._awake(full, count)
            window = self._prepared(awake, full)
            self.awake_steps += count * len(window.moving)
            self.all_steps += count * self.dynamics.particles.count
            _rest(full, window)
            part = _part(full, window.chosen.particles)
            try:
                part = window.loop.advance(part, full.step + count)
            except StepError as failed:
                raise StepError(_merge(full, window, failed.state), failed.cause) from failed
            full = _merge(full, window, part)
        return full

    def _awake(self, full: State, count: int) -> Mask:
        """Slabs to be stepped."""
        speeds = self.slabs.largest(np.einsum("ni,ni->n", full.velocities, full.velocities))
        gains = self.slabs.largest(np.einsum("ni,ni->n", full.accelerations, full.accelerations))
        largest = full.memory[_LARGEST]
        largest[0] = max(largest[0], speeds.max())
        limit = self.tolerance * float(largest[0])
        # Rounding of positions gives forces, but no motion.
        rounding = _ROUNDING * self.highest**2 * float(np.abs(full.positions).max())
        moving = (speeds > limit) | (gains > limit / (count * self.dynamics.step_size) + rounding)
        moving |= self._driven(full.time, count)
        return self.slabs.widened(moving, self.reach)

    def _driven(self, time: float, count: int) -> Mask:
        """Slabs on which an imposed motion or load changes in the next `count` steps."""
        slabs = np.zeros(self.slabs.count, dtype=np.bool_)
        times = time + self.dynamics.step_size * np.arange(count + 1, dtype=np.float64)
        for motion in self.dynamics.constraints:
            assert isinstance(motion, ScheduledConstraint)
            values = motion.schedule(times, 0)
            slabs |= self.slabs.marked(motion.entries[0][np.ptp(values, axis=0) > 0.0])
        for load in self.dynamics.loads:
            if isinstance(load, ScheduledLoad):
                changes = np.ptp(load.schedule(times), axis=0).max(axis=1) > 0.0
                slabs |= self.slabs.marked(load.particles[changes])
        return slabs

    def _prepared(self, awake: Mask, full: State) -> _Window:
        if self._window is None or not np.array_equal(awake, self._window.awake):
            self._window = self._new_window(awake, full)
        return self._window

    def _new_window(self, awake: Mask, full: State) -> _Window:
        whole, slabs = self.dynamics, self.slabs
        near = slabs.widened(awake, self.halo)
        chosen = Subset.of(np.flatnonzero(near[slabs.of]), whole.particles.count)
        asleep = ~awake[slabs.of]
        moving = np.flatnonzero(~asleep[chosen.particles])
        internal = whole.internal.part(chosen.particles)
        assert internal is not None, "`check_sleep` has refused it"
        still = np.flatnonzero(asleep[chosen.particles])
        u = full.positions[chosen.particles] - whole.particles.positions[chosen.particles]
        constraints = [term.part(chosen, asleep) for term in whole.constraints]
        loads = [load.part(chosen) for load in whole.loads]
        dynamics = Dynamics(
            particles=part_of(self.body, chosen.particles).particles,
            masses=whole.masses[chosen.particles],
            internal=internal,
            constraints=[Frozen.of(still, u), *(term for term in constraints if term is not None)],
            loads=[load for load in loads if load is not None],
            step_size=whole.step_size,
        )
        loop = steps_of(dynamics, self.integrator)
        return _Window(awake, chosen, moving, dynamics, loop)


def _writable(state: State) -> State:
    """Copy of a state whose arrays may be changed in place."""
    memory = {
        **state.memory,
        MEAN_VELOCITY: state.memory[MEAN_VELOCITY].copy(),
        _LARGEST: state.memory.get(_LARGEST, np.zeros(1)).copy(),
    }
    return attrs.evolve(
        state,
        positions=state.positions.copy(),
        velocities=state.velocities.copy(),
        accelerations=state.accelerations.copy(),
        memory=memory,
        applied={name: force.copy() for name, force in state.applied.items()},
    )


def _rest(full: State, window: _Window) -> None:
    """Set sleeping particles of `full` at rest."""
    asleep = np.ones(len(full.positions), dtype=np.bool_)
    asleep[window.awake_particles] = False
    for values in (full.velocities, full.accelerations, full.memory[MEAN_VELOCITY]):
        values[asleep] = 0.0


def _part(full: State, chosen: Indices) -> State:
    """State of the chosen particles."""
    applied = {name: force[chosen] for name, force in full.applied.items()}
    return attrs.evolve(
        full,
        positions=full.positions[chosen],
        velocities=full.velocities[chosen],
        accelerations=full.accelerations[chosen],
        memory={MEAN_VELOCITY: full.memory[MEAN_VELOCITY][chosen]},
        applied={**applied, ASLEEP: np.zeros((len(chosen), full.positions.shape[1]))},
        work={**full.work, ASLEEP: 0.0},
    )


def _merge(full: State, window: _Window, part: State) -> State:
    """`full` after the awake particles moved to their state in `part`."""
    for values, changed in (
        (full.positions, part.positions),
        (full.velocities, part.velocities),
        (full.accelerations, part.accelerations),
        (full.memory[MEAN_VELOCITY], part.memory[MEAN_VELOCITY]),
        *((full.applied[name], part.applied[name]) for name in full.applied),
    ):
        values[window.awake_particles] = changed[window.moving]
    work = {name: value for name, value in part.work.items() if name != ASLEEP}
    return attrs.evolve(full, time=part.time, step=part.step, work=work)
