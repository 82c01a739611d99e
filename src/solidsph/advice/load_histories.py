"""How what a scene imposes goes on in time: asked at some times, ahead of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import attrs
import numpy as np

from solidsph.interfaces.compilable_terms import ScheduledConstraint, ScheduledLoad
from solidsph.interfaces.terms import Load, SurfaceLoad
from solidsph.maths.arrays import Array
from solidsph.run.built_scene import BuiltScene

# Numbers asked of one condition at most, and times.
_ENTRIES, _TIMES = 2_000_000, 160


@attrs.frozen(eq=False)
class Signal:
    """The size of something imposed, over time."""

    label: str
    times: Array  # (t,) [s], increasing
    sizes: Array  # (t,) of the largest entry, in the unit of what it is

    @property
    def peak(self) -> float:
        """Its largest size."""
        return float(self.sizes.max())

    @property
    def rise(self) -> float:
        """Time of the first rise to nine tenths of the peak, as a straight ramp [s]."""
        if not self.peak > 0.0:
            return np.inf
        above = int(np.argmax(self.sizes >= 0.9 * self.peak))
        before = np.flatnonzero(self.sizes[: above + 1] <= 0.1 * self.peak)
        if not len(before):
            return 0.0  # it is there from the beginning
        return float(self.times[above] - self.times[before[-1]]) / 0.8

    @property
    def settled(self) -> float:
        """Time from which it does not change any more [s]; infinite if it changes to the end."""
        moves = np.abs(self.sizes - self.sizes[-1]) > 1e-6 * self.peak
        if not moves.any():
            return 0.0
        last = int(np.flatnonzero(moves)[-1])
        return float(self.times[last + 1]) if last + 2 < len(self.times) else np.inf


@attrs.frozen(eq=False)
class LoadHistory(Signal):
    """A force, by the stress or the acceleration that it makes."""

    stresses: Array  # (t,) largest force over the area that its particle owns [Pa]; 0 inside
    accelerations: Array  # (t,) largest force over mass [m/s^2]
    on_surface: bool


@attrs.frozen(eq=False)
class Motion(Signal):
    """A displacement imposed [m], with its velocity."""

    speeds: Array  # (t,) [m/s]
    condition: ScheduledConstraint

    @property
    def jump(self) -> float:
        """Speed that it has from the first moment on [m/s]."""
        return float(self.speeds[0])


def loads(simulation: BuiltScene) -> Iterator[LoadHistory]:
    """Of every force: at many times where it is a schedule, at a few where it is not.

    What answers to the motion is asked at the start, where nothing has moved.
    """
    areas = np.linalg.norm(simulation.particles.area_vectors, axis=1)
    for load in simulation.dynamics.loads:
        yield _of_load(simulation, load, areas[load.particles])


def _of_load(simulation: BuiltScene, load: Load, areas: Array) -> LoadHistory:
    start, masses = simulation.initial, simulation.model.masses[load.particles]
    ask = _asked(load, start.positions, start.velocities)
    times = _times(simulation, len(masses) * simulation.particles.dimension)
    if not isinstance(load, ScheduledLoad):
        times = times[:: max(1, len(times) // 4)]
    owns, real = areas > 0.0, masses > 0.0

    def found(some: Array) -> tuple[Array, ...]:
        forces = np.linalg.norm(ask(some), axis=2)
        pulls = (forces[:, real] / masses[real]).max(axis=1, initial=0.0)
        # A particle at an edge owns of both faces, and so is loaded less than the others.
        pressed = (forces[:, owns] / areas[owns]).max(axis=1, initial=0.0)
        return forces.max(axis=1, initial=0.0), pulls, pressed

    times, (sizes, pulls, pressed) = _refined(times, found(times), found)
    on_surface = isinstance(load, SurfaceLoad)
    return LoadHistory(
        label=load.label,
        times=times,
        sizes=sizes,
        stresses=pressed if on_surface else np.zeros_like(sizes),
        accelerations=pulls,
        on_surface=on_surface,
    )


def motions(simulation: BuiltScene) -> Iterator[Motion]:
    """Of every motion that is a schedule."""
    for motion in simulation.dynamics.constraints:
        if isinstance(motion, ScheduledConstraint):
            yield _of_motion(simulation, motion)


def _of_motion(simulation: BuiltScene, motion: ScheduledConstraint) -> Motion:
    times = _times(simulation, len(motion.entries[0]))

    def found(some: Array) -> tuple[Array, ...]:
        values = (np.abs(motion.schedule(some, k)).max(axis=1, initial=0.0) for k in (0, 1))
        return tuple(np.broadcast_to(one, (len(some),)) for one in values)

    times, (sizes, speeds) = _refined(times, found(times), found)
    return Motion(motion.label, times, sizes, speeds, motion)


def _asked(load: Load, x: Array, v: Array) -> Callable[[Array], Array]:
    """Forces (t, k, d) at times (t,)."""
    if isinstance(load, ScheduledLoad):

        def scheduled(times: Array) -> Array:
            found = load.schedule(times)
            return np.broadcast_to(found, (len(times), *found.shape[1:]))

        return scheduled
    return lambda times: np.stack([load.forces(float(t), x, v) for t in times])


def _times(simulation: BuiltScene, width: int) -> Array:
    """From 0 to the end of the duration, close together at the start."""
    end = simulation.scene.duration
    count = max(8, min(_TIMES, _ENTRIES // max(1, width)))
    first = min(simulation.step_size, 0.1 * end)
    early = np.geomspace(first, end, count // 2)
    return np.unique(np.concatenate([[0.0], early, np.linspace(0.0, end, count - count // 2)]))


def _refined(
    times: Array, values: tuple[Array, ...], found: Callable[[Array], tuple[Array, ...]]
) -> tuple[Array, tuple[Array, ...]]:
    """The same with times between the two at which the first rise was passed over."""
    sizes = values[0]
    if len(times) < 3 or not sizes.max() > 0.0:
        return times, values
    above = int(np.argmax(sizes >= 0.9 * sizes.max()))
    if above == 0 or sizes[above - 1] > 0.1 * sizes.max():
        return times, values
    between = np.linspace(times[above - 1], times[above], min(len(times), 34))[1:-1]
    own = found(between)
    joined = tuple(
        np.concatenate([a[:above], b, a[above:]]) for a, b in zip(values, own, strict=True)
    )
    return np.concatenate([times[:above], between, times[above:]]), joined
