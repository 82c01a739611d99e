"""Time histories of loads and prescribed motions, sampled ahead of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import attrs
import numpy as np

from solidsph.interfaces.compilable_terms import ScheduledConstraint, ScheduledLoad
from solidsph.interfaces.terms import Load, SurfaceLoad
from solidsph.maths.arrays import Array
from solidsph.run.built_scene import BuiltScene

# Most numbers, and most times, that are asked of one term.
_ENTRIES, _TIMES = 2_000_000, 160


@attrs.frozen(eq=False)
class TimeHistory:
    """Size of something imposed, over time."""

    label: str
    times: Array  # (t,) [s], increasing
    sizes: Array  # (t,) largest entry, in the unit of what is imposed

    @property
    def peak(self) -> float:
        """Largest size."""
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
        """Time from which it is constant [s]; infinite if it changes to the end."""
        changes = np.abs(self.sizes - self.sizes[-1]) > 1e-6 * self.peak
        if not changes.any():
            return 0.0
        last = int(np.flatnonzero(changes)[-1])
        return float(self.times[last + 1]) if last + 2 < len(self.times) else np.inf


@attrs.frozen(eq=False)
class LoadHistory(TimeHistory):
    """A force [N], and the stress and the acceleration that it makes."""

    stresses: Array  # (t,) largest force over the area that its particle owns [Pa]; 0 inside
    accelerations: Array  # (t,) largest force over mass [m/s^2]
    mean_accelerations: Array  # (t,) force over mass of all its particles together [m/s^2]
    on_surface: bool


@attrs.frozen(eq=False)
class MotionHistory(TimeHistory):
    """A prescribed displacement [m], and its velocity."""

    speeds: Array  # (t,) [m/s]


def load_histories(simulation: BuiltScene) -> Iterator[LoadHistory]:
    """History of every load: at many times if it is a schedule, at a few if not.

    A load that depends on the motion is asked for the start, where nothing has moved.
    """
    areas = np.linalg.norm(simulation.particles.area_vectors, axis=1)
    for load in simulation.dynamics.loads:
        yield _load_history(simulation, load, areas[load.particles])


def _load_history(simulation: BuiltScene, load: Load, areas: Array) -> LoadHistory:
    start, masses = simulation.initial, simulation.model.masses[load.particles]
    times = _times(simulation, len(masses) * simulation.particles.dimension)
    if not isinstance(load, ScheduledLoad):
        times = times[:: max(1, len(times) // 4)]
    owns, real, mass = areas > 0.0, masses > 0.0, float(masses.sum())

    def sample(some: Array) -> tuple[Array, ...]:
        if isinstance(load, ScheduledLoad):
            forces = load.schedule(some)
            forces = np.broadcast_to(forces, (len(some), *forces.shape[1:]))
        else:
            x, v = start.positions, start.velocities
            forces = np.stack([load.forces(float(t), x, v) for t in some])
        sizes = np.linalg.norm(forces, axis=2)
        accelerations = (sizes[:, real] / masses[real]).max(axis=1, initial=0.0)
        together = np.linalg.norm(forces.sum(axis=1), axis=1)
        means = together / mass if mass > 0.0 else np.zeros(len(some))
        # A particle at an edge owns area of both faces, so its stress is less than the others'.
        stresses = (sizes[:, owns] / areas[owns]).max(axis=1, initial=0.0)
        return sizes.max(axis=1, initial=0.0), stresses, accelerations, means

    times, (sizes, stresses, accelerations, means) = _sampled(times, sample)
    on_surface = isinstance(load, SurfaceLoad)
    stresses = stresses if on_surface else np.zeros_like(sizes)
    return LoadHistory(load.label, times, sizes, stresses, accelerations, means, on_surface)


def motion_histories(simulation: BuiltScene) -> Iterator[MotionHistory]:
    """History of every constraint that is a schedule."""
    for motion in simulation.dynamics.constraints:
        if isinstance(motion, ScheduledConstraint):

            def sample(some: Array, motion: ScheduledConstraint = motion) -> tuple[Array, ...]:
                several = (motion.schedule(some, k, simulation.step_size) for k in (0, 1))
                largest = (np.abs(values).max(axis=1, initial=0.0) for values in several)
                return tuple(np.broadcast_to(value, (len(some),)) for value in largest)

            times = _times(simulation, len(motion.entries[0]))
            times, (sizes, speeds) = _sampled(times, sample)
            yield MotionHistory(motion.label, times, sizes, speeds)


def _times(simulation: BuiltScene, width: int) -> Array:
    """Times from 0 to the end, dense at the start, for `width` numbers at each."""
    end = simulation.scene.duration
    count = max(8, min(_TIMES, _ENTRIES // max(1, width)))
    first = min(simulation.step_size, 0.1 * end)
    early = np.geomspace(first, end, count // 2)
    return np.unique(np.concatenate([[0.0], early, np.linspace(0.0, end, count - count // 2)]))


def _sampled(
    times: Array, sample: Callable[[Array], tuple[Array, ...]]
) -> tuple[Array, tuple[Array, ...]]:
    """Times and samples, with more of them between two times that skip the first rise."""
    values = sample(times)
    sizes, peak = values[0], values[0].max()
    above = int(np.argmax(sizes >= 0.9 * peak))
    if len(times) < 3 or not peak > 0.0 or above == 0 or sizes[above - 1] > 0.1 * peak:
        return times, values
    between = np.linspace(times[above - 1], times[above], min(len(times), 34))[1:-1]
    joined = tuple(
        np.concatenate([a[:above], b, a[above:]])
        for a, b in zip(values, sample(between), strict=True)
    )
    return np.concatenate([times[:above], between, times[above:]]), joined
