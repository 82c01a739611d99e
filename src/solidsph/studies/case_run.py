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
from solidsph.run.outcome import FINISHED
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement


@attrs.frozen
class SceneRun:
    """Outcome and cost of one scene of a case."""

    name: str
    record: Path
    seconds: float  # wall time, building included [s]
    steps: int  # recorded steps in time, or load steps
    evaluations: int  # of the forces, or of the tangent
    particles: int
    spacing: float  # the smallest, of the particles as they are placed [m]
    pairs: int
    pairs_visited: int  # in an evaluation, those of effects included
    bytes_touched: int  # in an evaluation, at least
    outcome: str


@attrs.frozen
class CaseResult:
    """Measurements and files of a case."""

    measurements: Sequence[Measurement]
    runs: Sequence[SceneRun]
    pictures: Sequence[Path]
    tables: Sequence[Path]  # of the curves in the pictures
    peak_memory: int  # of this process so far [bytes]

    @property
    def passed(self) -> bool:
        """Whether every measurement is as its source predicts."""
        return all(m.passed for m in self.measurements)


Begin = Callable[[str, Simulation], Sequence[object]]
"""Called before each run with the name of the scene; returns observers of the run."""


Ahead = Callable[[Scene], None]
"""Called before each scene is built."""


def run_case(
    case: Case,
    folder: Path,
    *,
    ahead: Ahead = lambda scene: None,
    begin: Begin = lambda name, simulation: (),
) -> CaseResult:
    """Run every scene of `case`, record it in `folder`, measure and draw.

    Raises:
        RecordError: another run of a case writes into that folder.
    """
    # No other process may replace the records before they have been measured.
    with sole_writer(folder / "case"):
        runs = run_scenes(case, folder, ahead=ahead, begin=begin)
        with open_records(runs) as records:
            measurements = case.measure(records)
            pictures = case.draw(records, folder)
            tables = [
                _write_table(folder / f"{name}.csv", curves)
                for name, curves in case.curves(records).items()
            ]
    return CaseResult(measurements, runs, pictures, tables, peak_memory())


def run_scenes(
    case: Case,
    folder: Path,
    *,
    ahead: Ahead = lambda scene: None,
    begin: Begin = lambda name, simulation: (),
) -> Sequence[SceneRun]:
    """Run every scene of `case` and record it in `folder`.

    A scene that diverges, is unsound or finds no equilibrium does not end the case. Its record is
    measured, because for some combinations of parts divergence is the expected result.
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
            if not path.exists():  # it failed before the first output
                raise
            outcome = _outcome(cause)
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
                spacing=float(simulation.particles.spacings.min()),
                pairs=simulation.dynamics.internal.pair_count,
                pairs_visited=work.visited,
                bytes_touched=work.touched,
                outcome=outcome,
            )
        )
    return runs


@contextmanager
def open_records(runs: Sequence[SceneRun]) -> Iterator[Mapping[str, Record]]:
    """Records of `runs`, by scene."""
    with ExitStack() as stack:
        yield {run.name: stack.enter_context(Record(run.record)) for run in runs}


def _write_table(path: Path, curves: Curves) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    values = np.column_stack(list(curves.values()))
    np.savetxt(path, values, "%.9g", delimiter=",", header=",".join(curves), comments="")
    return path


def _outcome(cause: DivergedError | UnsoundError | ConvergenceError) -> str:
    if isinstance(cause, UnsoundError):
        return f"unsound: {cause}"
    if isinstance(cause, DivergedError):
        return f"diverged at step {cause.step}: {cause.cause}"
    return f"no equilibrium beyond load factor {cause.load_factor:g}: {cause.cause}"
