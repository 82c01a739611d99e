"""Receipts: what each effect of a run has taken, done and changed, found by leaving it out.

Time is that of steps of the scene as it is, with and without the effect, in turns. What it changes
is found at reduced size, where a run without each effect is affordable: fewer particles, and a
shorter duration if it is long. Runs with and without it make the same steps.
"""

from __future__ import annotations

import re
import tempfile
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TypeAlias

import attrs
import numpy as np

from solidsph.costs.effect_shares import without
from solidsph.errors import BuildError, ConvergenceError, DivergedError, SceneError, UnsoundError
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.time_loop import StepError, TimeLoop
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.registry.construct import construct
from solidsph.results.record import Record
from solidsph.run.energy import RESIDUAL
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import BodyScene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case

LARGEST = "largest displacement [m]"

COARSER = 2.0
"""Times the spacing, of the runs in which effects are left out."""

# Particles along the shortest side of a body below which it is made no coarser.
_FEWEST = 3.0

# What a reduced run may take, and what a step and a pair of it take, about [s].
_BUDGET, _STEP, _PAIR = 20.0, 1e-4, 25e-9

# Of the timing: rounds, and how long a sample of each is at least [s].
_ROUNDS, _SAMPLE = 7, 0.03

# Columns of a history that never leave this part of the largest one of their unit are rounding.
_ROUNDING = 1e-9

Series: TypeAlias = Mapping[str, Array]
"""Quantities over the outputs of a run, each (steps,)."""


@attrs.frozen
class Receipt:
    """Of one effect."""

    label: str
    share: float | None  # of the time of steps [-]; None where nothing is stepped
    work: float | None  # that its account has done [J]; None where there is no run with it
    acted: bool  # whether its account or any quantity shows it at all
    changes: Mapping[str, float]  # by quantity, over the largest value with it [-]
    outcome: str  # of the run without it: "finished", or how it failed

    @property
    def line(self) -> str:
        """As a sentence."""
        time = "" if self.share is None else f"{percent(max(0.0, self.share))} of the time, "
        if self.outcome != FINISHED:
            return f"{self.label}: {time}needed: without it the run {self.outcome}"
        if not self.acted:
            return f"{self.label}: {time}never acted"
        name = next(iter(self.changes), None)
        if name is None:
            return f"{self.label}: {time}acted"
        what = name.partition("=")[0] if "@" in name else name.partition(" [")[0]
        return f"{self.label}: {time}changed the {what} by {percent(self.changes[name])}"


FINISHED = "finished"


def percent(part: float) -> str:
    """As a person reads it."""
    value = 100.0 * part
    return f"{value:.0f} %" if abs(value) >= 10.0 else f"{value:.2g} %"


@attrs.frozen
class Receipts:
    """Of a scene."""

    each: Sequence[Receipt]
    coarser: float  # spacing of the runs without effects, over that of the scene
    duration: float  # of those runs [s]
    particles: int  # of those runs
    outcome: str  # of the reduced run with all effects


@attrs.frozen
class _Run:
    outcome: str
    series: Series
    work: Mapping[str, float]


def receipts(
    simulation: Simulation,
    *,
    end: State | None = None,
    of: Sequence[str] = (),
    coarser: float = COARSER,
) -> Receipts:
    """What the effects of a scene have taken and changed.

    Args:
        simulation: the scene, built.
        end: the last state of its run, from which steps are timed; the first one by default.
        of: quantities to add, each as `quantity` reads it.
        coarser: the spacing of runs without an effect, over the scene's.

    Raises:
        SceneError: a quantity is not understood.
    """
    for one in of:
        quantity(one)
    with tempfile.TemporaryDirectory() as folder:
        for factor in (coarser, 1.0):
            small = reduced(simulation.scene, factor)
            whole = Simulation.builder(small).build()
            base = _carried_out(whole, Path(folder) / "with.h5", of)
            if base.outcome == FINISHED:
                break  # else the scene does not stand being coarser
        shares = measured_shares(simulation, end)
        each = []
        for label in simulation.effects:
            less = _carried_out(without(whole, label), Path(folder) / "without.h5", of)
            each.append(_receipt(label, shares.get(label), base, less))
    factor = _coarsening(simulation.scene, small)
    return Receipts(each, factor, small.duration, whole.particles.count, base.outcome)


def case_changes(case: Case, coarser: float = COARSER) -> Mapping[str, Mapping[str, float]]:
    """By effect and quantity, how much what a case measures changes without it [-].

    Empty where the case cannot measure its scenes at reduced size.
    """
    scenes = {name: reduced(scene, coarser) for name, scene in case.scenes().items()}
    built = {name: Simulation.builder(scene).build() for name, scene in scenes.items()}
    labels = dict.fromkeys(label for one in built.values() for label in one.effects)
    if not labels:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        paths = {name: Path(folder) / f"{name}.h5" for name in built}
        for name, simulation in built.items():
            _carried_out(simulation, paths[name], ())
        base = _measured(case, paths)
        changes: dict[str, Mapping[str, float]] = {}
        for label in labels:
            others = dict(paths)
            for name, simulation in built.items():
                if label in simulation.effects:
                    others[name] = Path(folder) / f"{name}-without.h5"
                    _carried_out(without(simulation, label), others[name], ())
            less = _measured(case, others)
            changes[label] = {
                name: abs(less[name] - value) / (abs(value) or 1.0)
                for name, value in base.items()
                if name in less
            }
    return changes


def _measured(case: Case, paths: Mapping[str, Path]) -> Mapping[str, float]:
    try:
        with ExitStack() as stack:
            records = {name: stack.enter_context(Record(path)) for name, path in paths.items()}
            return {m.quantity: m.value for m in case.measure(records)}
    except Exception:  # a case may rely on its own resolution
        return {}


def measured_shares(
    simulation: Simulation,
    end: State | None = None,
    ticks: Callable[[], float] = clock.process_time,
) -> Mapping[str, float]:
    """Of every effect, its part in the time of steps of the scene as it is [-].

    Steps with and without it take turns, and of each the quickest sample counts: what else goes on
    only ever adds. Shares below about 0.02 are within what is left of that.

    Args:
        simulation: the scene, built.
        end: the state from which steps are timed; the first one by default.
        ticks: the time [s]; that of the processor, which other programs change less.
    """
    if simulation.scene.statics is not None or not simulation.effects:
        return {}
    begin = simulation.start() if end is None else end
    variants = {"": simulation} | {name: without(simulation, name) for name in simulation.effects}
    loops = {name: one.time_loop() for name, one in variants.items()}
    counts = dict.fromkeys(loops, 1)
    for name, loop in loops.items():
        loop.advance(begin, begin.step + 1)  # compiles, and makes what is made once
        while _seconds(loop, begin, counts[name], ticks) < _SAMPLE and counts[name] < 10**6:
            counts[name] *= 2
    times: dict[str, list[float]] = {name: [] for name in loops}
    for _ in range(_ROUNDS):
        for name, loop in loops.items():
            times[name].append(_seconds(loop, begin, counts[name], ticks) / counts[name])
    whole = min(times[""])
    return {name: 1.0 - min(times[name]) / whole for name in simulation.effects}


def _seconds(loop: TimeLoop, begin: State, count: int, ticks: Callable[[], float]) -> float:
    begun = ticks()
    with suppress(StepError):  # without it the motion may fail
        loop.advance(begin, begin.step + count)
    return ticks() - begun


def reduced(scene: Scene, coarser: float = COARSER) -> Scene:
    """The scene at a coarser spacing, where it can be, and no longer than is affordable."""
    bodies = {name: _coarser(body, coarser) for name, body in scene.bodies.items()}
    small = attrs.evolve(scene, bodies=bodies, engine="matrix", time_step=None)
    try:
        built = Simulation.builder(small).build()
    except BuildError:  # what is smaller than the coarser spacing matches nothing
        small = attrs.evolve(scene, engine="matrix")
        built = Simulation.builder(small).build()
    if scene.statics is not None:
        return small
    cost = _STEP + _PAIR * built.dynamics.internal.pair_count * (1 + len(built.effects))
    most = max(1, int(_BUDGET / cost))
    if built.steps <= most:
        return small
    part = most / built.steps
    outputs = max(2, round(scene.outputs * part))
    return attrs.evolve(small, duration=part * scene.duration, outputs=outputs)


def _coarser(body: BodyScene, factor: float) -> BodyScene:
    shape: Shape = construct("shapes", body.shape)
    lower, upper = shape.bounds()
    most = float((upper - lower).min()) / _FEWEST
    return attrs.evolve(body, spacing=max(body.spacing, min(factor * body.spacing, most)))


def _coarsening(scene: Scene, small: Scene) -> float:
    return max(small.bodies[name].spacing / body.spacing for name, body in scene.bodies.items())


def _carried_out(simulation: Simulation, path: Path, of: Sequence[str]) -> _Run:
    outcome = FINISHED
    try:
        simulation.run(record=path)
    except DivergedError as cause:
        outcome = f"diverges at t = {cause.time:.3g} s: {cause.cause}"
    except UnsoundError as cause:
        outcome = f"is unsound: its energies miss by {cause.part:.3g}"
    except ConvergenceError as cause:
        outcome = f"finds no equilibrium beyond load factor {cause.load_factor:g}"
    if not path.exists():
        return _Run(outcome, {}, {})
    with Record(path) as record:
        work = {
            name.removeprefix("work of ").removesuffix(" [J]"): float(values[-1])
            for name, values in record.history.items()
            if name.startswith("work of ")
        }
        return _Run(outcome, dict(_series(record, of)), work)


def _series(record: Record, of: Sequence[str]) -> Iterator[tuple[str, Array]]:
    """What is asked for, the largest displacement, and the columns of the history."""
    for one in of:
        yield one, quantity(one)(record)
    particles = record.particles
    real = ~particles.ghosts
    moved = [x[real] - particles.positions[real] for x in record.positions]
    yield LARGEST, np.array([np.linalg.norm(u, axis=1).max() for u in moved])
    columns = {
        name: np.asarray(values, dtype=np.float64)
        for name, values in record.history.items()
        if not name.startswith("work of ") and name != RESIDUAL
    }
    scale: dict[str, float] = {}
    for name, values in columns.items():
        unit = name.rpartition("[")[2]
        scale[unit] = max(scale.get(unit, 0.0), float(np.abs(values).max(initial=0.0)))
    for name, values in columns.items():
        if np.abs(values).max(initial=0.0) > _ROUNDING * scale[name.rpartition("[")[2]]:
            yield name, values


@attrs.frozen
class _Displacement:
    axis: int
    point: tuple[float, ...]

    def __call__(self, record: Record) -> Array:
        X = record.particles.positions
        if len(self.point) != X.shape[1] or self.axis >= X.shape[1]:
            raise SceneError(
                f"the point {list(self.point)} and {'xyz'[self.axis]} are not of {X.shape[1]} "
                "dimensions; give one coordinate for each"
            )
        nearest = int(np.argmin(np.linalg.norm(X - self.point, axis=1)))
        places = np.array([x[nearest, self.axis] for x in record.positions])
        moved: Array = places - X[nearest, self.axis]
        return moved


@attrs.frozen
class _Column:
    name: str

    def __call__(self, record: Record) -> Array:
        for name, values in record.history.items():
            if self.name in (name, name.partition(" [")[0]):
                return np.asarray(values, dtype=np.float64)
        raise SceneError(
            f"no column {self.name!r} in the history; there are {', '.join(record.history)}"
        )


def quantity(text: str) -> _Displacement | _Column:
    """`NAME=x@[X, Y]`, the displacement of the particle nearest to a point, or a history column.

    Raises:
        SceneError: it is of neither form.
    """
    if "@" not in text:
        return _Column(text)
    found = re.fullmatch(r"[^=]+=\s*([xyz])\s*@\s*\[([^]]*)\]", text)
    try:
        if found is None:
            raise ValueError
        point = tuple(float(one) for one in found[2].split(","))
    except ValueError:
        raise SceneError(
            f"--receipts-of {text!r} is not understood; write NAME=x@[0.35, 0.01], or the name of "
            "a column of the history"
        ) from None
    return _Displacement("xyz".index(found[1]), point)


def _receipt(label: str, share: float | None, base: _Run, less: _Run) -> Receipt:
    changes = {}
    for name, values in base.series.items():
        if name.startswith(f"{label} "):
            continue  # what the effect itself reports
        other = less.series.get(name, np.zeros_like(values))  # missing is what rounding leaves
        both = min(len(values), len(other))
        scale = float(np.abs(values[:both]).max(initial=0.0))
        apart = float(np.abs(values[:both] - other[:both]).max(initial=0.0))
        changes[name] = apart / scale if scale > 0.0 else float(apart > 0.0)
    work = base.work.get(label)
    outcome = less.outcome if base.outcome == FINISHED else FINISHED
    acted = bool(work) or any(change > 0.0 for change in changes.values())
    return Receipt(label, share, work, acted, changes, outcome)
