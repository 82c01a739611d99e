"""Receipts: the cost, work and influence of each effect of a run, found by leaving it out.

The cost is that of steps of the scene itself, with and without the effect in turns. The influence
is found at reduced size, where a run without each effect is affordable: with fewer particles, and
for a shorter duration if it is long. Runs with and without the effect make the same steps.
"""

from __future__ import annotations

import re
import tempfile
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import partial
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
from solidsph.run.outcome import FINISHED
from solidsph.scene.graded_spacing import least_spacing, scaled
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import BodyScene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case

LARGEST = "largest displacement [m]"

COARSER = 2.0
"""Spacing of the runs without an effect, over that of the scene."""

# A body keeps at least this many particles along its shortest side.
_FEWEST = 3.0

# Time that a reduced run may take, and about what a step and a pair of it take [s].
_BUDGET, _STEP, _PAIR = 20.0, 1e-4, 25e-9

# Rounds of timing, and the shortest sample in each [s].
_ROUNDS, _SAMPLE = 7, 0.03

# Columns of a history below this part of the largest one of their unit are rounding.
_ROUNDING = 1e-9

# How the histories of works are called, and their unit.
_WORK, _JOULE = "work of ", " [J]"

Series: TypeAlias = Mapping[str, Array]
"""Quantities at the outputs of a run, each (outputs,)."""


@attrs.frozen
class Receipt:
    """Cost and influence of one effect."""

    label: str
    share: float | None  # of the time of steps [-]; None for an equilibrium
    work: float | None  # done by its account [J]; None without a run
    acted: bool  # whether its account or any quantity shows it
    changes: Mapping[str, float]  # by quantity, over the largest value with it [-]
    outcome: str  # of the run without it: "finished", or how it failed

    @property
    def line(self) -> str:
        """Summary in one line."""
        time = "" if self.share is None else f"{percent(max(0.0, self.share))} of the time, "
        if self.outcome != FINISHED:
            return f"{self.label}: {time}needed: without it the run {self.outcome}"
        if not self.acted:
            return f"{self.label}: {time}never acted"
        name = next(iter(self.changes), None)
        if name is None:
            return f"{self.label}: {time}acted"
        return (
            f"{self.label}: {time}changed the {short_name(name)} by {percent(self.changes[name])}"
        )


def percent(part: float) -> str:
    """A part of one in per cent, rounded for reading."""
    value = 100.0 * part
    return f"{value:.0f} %" if abs(value) >= 10.0 else f"{value:.2g} %"


def short_name(name: str) -> str:
    """A quantity without its unit or its place."""
    return name.partition("=" if "@" in name else " [")[0]


@attrs.frozen
class Receipts:
    """Receipts of a scene."""

    each: Sequence[Receipt]
    coarser: float  # spacing of the runs without effects, over that of the scene
    duration: float  # of those runs [s]
    particles: int  # of those runs
    outcome: str  # of the reduced run with all effects


@attrs.frozen
class _Run:
    outcome: str
    series: Series = attrs.field(factory=dict)
    work: Mapping[str, float] = attrs.field(factory=dict)


def receipts(
    simulation: Simulation,
    *,
    end: State | None = None,
    of: Sequence[str] = (),
    coarser: float = COARSER,
) -> Receipts:
    """Receipts of the effects of a scene.

    Args:
        simulation: the scene, built.
        end: last state of its run, from which steps are timed; the first one by default.
        of: further quantities, each as `quantity` reads it.
        coarser: spacing of the runs without an effect, over that of the scene.

    Raises:
        SceneError: a quantity is of neither form.
    """
    for text in of:
        quantity(text)
    with tempfile.TemporaryDirectory() as folder:
        for factor in (coarser, 1.0):
            small = reduced(simulation.scene, factor)
            whole = Simulation.builder(small).build()
            base = _run(whole, Path(folder) / "with.h5", of)
            if base.outcome == FINISHED:
                break  # otherwise the scene needs its full resolution
        shares = measured_shares(simulation, end)
        each = []
        for label in simulation.effects:
            less = _run(without(whole, label), Path(folder) / "without.h5", of)
            each.append(_receipt(label, shares.get(label), base, less))
    factor = max(
        least_spacing(small.bodies[name]) / least_spacing(body)
        for name, body in simulation.scene.bodies.items()
    )
    return Receipts(each, factor, small.duration, whole.particles.count, base.outcome)


def _receipt(label: str, share: float | None, base: _Run, less: _Run) -> Receipt:
    changes = {}
    for name, values in base.series.items():
        if name.startswith(f"{label} "):
            continue  # reported by the effect itself
        other = less.series.get(name, np.zeros_like(values))  # absent if it is only rounding
        both = min(len(values), len(other))
        scale = float(np.abs(values[:both]).max(initial=0.0))
        apart = float(np.abs(values[:both] - other[:both]).max(initial=0.0))
        changes[name] = apart / scale if scale > 0.0 else float(apart > 0.0)
    work = base.work.get(label)
    outcome = less.outcome if base.outcome == FINISHED else FINISHED
    acted = bool(work) or any(change > 0.0 for change in changes.values())
    return Receipt(label, share, work, acted, changes, outcome)


def case_changes(case: Case, coarser: float = COARSER) -> Mapping[str, Mapping[str, float]]:
    """Relative change of every measurement of a case without an effect, by effect and quantity [-].

    Empty if the case cannot measure its scenes at reduced size.
    """
    scenes = {name: reduced(scene, coarser) for name, scene in case.scenes().items()}
    built = {name: Simulation.builder(scene).build() for name, scene in scenes.items()}
    labels = dict.fromkeys(label for simulation in built.values() for label in simulation.effects)
    if not labels:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        paths = {name: Path(folder) / f"{name}.h5" for name in built}
        for name, simulation in built.items():
            _run(simulation, paths[name], ())
        base = _measurements(case, paths)
        changes: dict[str, Mapping[str, float]] = {}
        for label in labels:
            others = dict(paths)
            for name, simulation in built.items():
                if label in simulation.effects:
                    others[name] = Path(folder) / f"{name}-without.h5"
                    _run(without(simulation, label), others[name], ())
            less = _measurements(case, others)
            changes[label] = {
                name: abs(less[name] - value) / (abs(value) or 1.0)
                for name, value in base.items()
                if name in less
            }
    return changes


def _measurements(case: Case, paths: Mapping[str, Path]) -> Mapping[str, float]:
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
    """Share of every effect in the time of steps of the scene at full size [-].

    Steps with and without it take turns, and the quickest sample of each counts, because other
    load only adds time. The remaining noise is about 0.02.

    Args:
        simulation: the scene, built.
        end: state from which steps are timed; the first one by default.
        ticks: clock [s]; by default that of the processor, which other programs disturb less.
    """
    if simulation.scene.statics is not None or not simulation.effects:
        return {}
    begin = simulation.start() if end is None else end
    variants = {"": simulation} | {name: without(simulation, name) for name in simulation.effects}
    loops = {name: variant.time_loop() for name, variant in variants.items()}
    counts = dict.fromkeys(loops, 1)
    for name, loop in loops.items():
        loop.advance(begin, begin.step + 1)  # compiles, and builds what is built once
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
    with suppress(StepError):  # without the effect the motion may fail
        loop.advance(begin, begin.step + count)
    return ticks() - begun


def reduced(scene: Scene, coarser: float = COARSER) -> Scene:
    """The scene at a coarser spacing, if it can be built so, and no longer than is affordable."""
    bodies = {name: _coarser(body, coarser) for name, body in scene.bodies.items()}
    small = attrs.evolve(scene, bodies=bodies, engine="matrix", time_step=None)
    try:
        built = Simulation.builder(small).build()
    except BuildError:  # a region smaller than the coarser spacing is empty
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
    return scaled(body, max(1.0, min(factor, most / least_spacing(body))))


def _run(simulation: Simulation, path: Path, of: Sequence[str]) -> _Run:
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
        return _Run(outcome)
    with Record(path) as record:
        work = {
            name.removeprefix(_WORK).removesuffix(_JOULE): float(values[-1])
            for name, values in record.history.items()
            if name.startswith(_WORK)
        }
        return _Run(outcome, dict(_series(record, of)), work)


def _series(record: Record, of: Sequence[str]) -> Iterator[tuple[str, Array]]:
    """Requested quantities, the largest displacement, and the columns of the history."""
    for text in of:
        yield text, quantity(text)(record)
    particles = record.particles
    real = ~particles.ghosts
    moved = [x[real] - particles.positions[real] for x in record.positions]
    yield LARGEST, np.array([np.linalg.norm(u, axis=1).max() for u in moved])
    columns = {
        name: np.asarray(values, dtype=np.float64)
        for name, values in record.history.items()
        if not name.startswith(_WORK) and name != RESIDUAL
    }
    largest = {name: float(np.abs(column).max(initial=0.0)) for name, column in columns.items()}
    scale: dict[str, float] = {}
    for name, size in largest.items():
        unit = name.rpartition("[")[2]
        scale[unit] = max(scale.get(unit, 0.0), size)
    for name, column in columns.items():
        if largest[name] > _ROUNDING * scale[name.rpartition("[")[2]]:
            yield name, column


def _displacement(record: Record, axis: str, point: tuple[float, ...]) -> Array:
    X = record.particles.positions
    column = "xyz".index(axis)
    if len(point) != X.shape[1] or column >= X.shape[1]:
        raise SceneError(
            f"the point {list(point)} and {axis} are not of {X.shape[1]} dimensions; give one "
            "coordinate for each"
        )
    nearest = int(np.argmin(np.linalg.norm(X - point, axis=1)))
    places = np.array([x[nearest, column] for x in record.positions])
    moved: Array = places - X[nearest, column]
    return moved


def _column(record: Record, wanted: str) -> Array:
    for name, values in record.history.items():
        if wanted in (name, name.partition(" [")[0]):
            return np.asarray(values, dtype=np.float64)
    raise SceneError(f"no column {wanted!r} in the history; there are {', '.join(record.history)}")


def quantity(text: str) -> Callable[[Record], Array]:
    """`NAME=x@[X, Y]`, the displacement of the particle nearest to a point, or a history column.

    Raises:
        SceneError: the text is of neither form.
    """
    if "@" not in text:
        return partial(_column, wanted=text)
    match = re.fullmatch(r"[^=]+=\s*([xyz])\s*@\s*\[([^]]*)\]", text)
    try:
        if match is None:
            raise ValueError
        point = tuple(float(number) for number in match[2].split(","))
    except ValueError:
        raise SceneError(
            f"--receipts-of {text!r} is not understood; write NAME=x@[0.35, 0.01], or the name of "
            "a column of the history"
        ) from None
    return partial(_displacement, axis=match[1], point=point)
