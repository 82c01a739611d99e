"""Running a case: its scenes, its measurements and its pictures."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from solidsph.costs.count import count_work
from solidsph.costs.process import peak_memory
from solidsph.errors import ConvergenceError, DivergedError, UnsoundError
from solidsph.results.record import Record
from solidsph.results.sole_writer import sole_writer
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement

FINISHED = "finished"


@attrs.frozen
class SceneRun:
    """What one scene of a case took."""

    name: str
    record: Path
    seconds: float  # wall time, building included [s]
    steps: int  # recorded steps in time, or load steps
    evaluations: int  # of the forces, or of the tangent
    particles: int
    pairs: int
    pairs_visited: int  # by an evaluation, for effects too
    bytes_touched: int  # that an evaluation must move at least
    outcome: str


@attrs.frozen
class CaseResult:
    """What a case measured, and what it left behind."""

    measurements: Sequence[Measurement]
    runs: Sequence[SceneRun]
    pictures: Sequence[Path]
    tables: Sequence[Path]  # of the curves in the pictures
    peak_memory: int  # of this process so far [bytes]

    @property
    def passed(self) -> bool:
        """Whether every measurement came out as its source predicts."""
        return all(m.passed for m in self.measurements)


Begin = Callable[[str, Simulation], Sequence[object]]
"""Called before each scene with its name; returns observers of its run."""


Ahead = Callable[[Scene], None]
"""Called before each scene is built."""


def _unchecked(scene: Scene) -> None:
    pass


def _unobserved(name: str, simulation: Simulation) -> Sequence[object]:
    return ()


def run_case(
    case: Case, folder: Path, *, ahead: Ahead = _unchecked, begin: Begin = _unobserved
) -> CaseResult:
    """Run every scene of `case`, record it in `folder`, measure and draw.

    Raises:
        RecordError: another run of a case writes into that folder.
    """
    # Until what was recorded has been measured, nobody else may replace it.
    with sole_writer(folder / "case"):
        return _run_case(case, folder, ahead, begin)


def _run_case(case: Case, folder: Path, ahead: Ahead, begin: Begin) -> CaseResult:
    runs = run_scenes(case, folder, ahead=ahead, begin=begin)
    with opened(runs) as records:
        measurements = case.measure(records)
        pictures = case.draw(records, folder)
        tables = [
            _written(folder / f"{name}.csv", curves)
            for name, curves in case.curves(records).items()
        ]
    return CaseResult(measurements, runs, pictures, tables, peak_memory())


def run_scenes(
    case: Case, folder: Path, *, ahead: Ahead = _unchecked, begin: Begin = _unobserved
) -> Sequence[SceneRun]:
    """Run every scene of `case` and record it in `folder`.

    A scene that diverges, is unsound or finds no equilibrium does not end the case: what it
    recorded is measured, because for some combinations of parts to diverge is the result.
    """
    runs = []
    for name, scene in case.scenes().items():
        path = folder / f"{name}.h5"
        outcome, begun = FINISHED, clock.perf_counter()
        ahead(scene)
        simulation = Simulation.builder(scene).build()
        effort: Mapping[str, Any] = {}
        observers = begin(name, simulation)
        try:
            effort = simulation.run(record=path, observers=observers).effort
        except (DivergedError, UnsoundError, ConvergenceError) as cause:
            if not path.exists():  # it failed before there was anything to measure
                raise
            outcome = _told(cause)
        seconds = clock.perf_counter() - begun
        work = count_work(simulation)
        with Record(path) as record:
            steps = int(record.steps[-1])
        runs.append(
            SceneRun(
                name=name,
                record=path,
                seconds=seconds,
                steps=steps,
                evaluations=effort.get("iterations", steps),
                particles=simulation.particles.count,
                pairs=simulation.dynamics.internal.pair_count,
                pairs_visited=work.visited,
                bytes_touched=work.touched,
                outcome=outcome,
            )
        )
    return runs


@contextmanager
def opened(runs: Sequence[SceneRun]) -> Iterator[Mapping[str, Record]]:
    """The records of `runs`, by scene."""
    with ExitStack() as stack:
        yield {run.name: stack.enter_context(Record(run.record)) for run in runs}


def _written(path: Path, curves: Curves) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    values = np.column_stack(list(curves.values()))
    np.savetxt(path, values, "%.9g", delimiter=",", header=",".join(curves), comments="")
    return path


def _told(cause: DivergedError | UnsoundError | ConvergenceError) -> str:
    if isinstance(cause, UnsoundError):
        return f"unsound: {cause}"
    if isinstance(cause, DivergedError):
        return f"diverged at step {cause.step}: {cause.cause}"
    return f"no equilibrium beyond load factor {cause.load_factor:g}: {cause.cause}"
