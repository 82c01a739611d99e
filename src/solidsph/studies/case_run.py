"""Running a case: its scenes, its measurements and its pictures."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import attrs
import numpy as np

from solidsph.builder import Builder
from solidsph.carry_out import carry_out
from solidsph.costs.process import peak_memory
from solidsph.errors import ConvergenceError, DivergedError
from solidsph.interfaces.case import Case, Curves, Measurement
from solidsph.results.record import Record
from solidsph.simulation import Simulation


@attrs.frozen
class SceneRun:
    """What one scene of a case took."""

    name: str
    record: Path
    seconds: float
    steps: int  # recorded steps in time, or load steps
    particles: int
    pairs: int
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


def run_case(
    case: Case,
    folder: Path,
    *,
    begin: Callable[[str, Simulation], Sequence[object]] = lambda name, simulation: (),
) -> CaseResult:
    """Run every scene of `case`, record it in `folder`, measure and draw.

    A scene that diverges, or finds no equilibrium, does not end the case: what it recorded is
    measured, because for some combinations of parts to diverge is the result.

    Args:
        begin: called before each scene; returns observers of its run.
    """
    runs = []
    for name, scene in case.scenes().items():
        simulation = Builder(scene).build()
        path = folder / f"{name}.h5"
        observers = begin(name, simulation)
        outcome, begun = "finished", clock.perf_counter()
        try:
            carry_out(simulation, record=path, observers=observers)
        except (DivergedError, ConvergenceError) as cause:
            if not path.exists():  # it failed before there was anything to measure
                raise
            outcome = _told(cause)
        seconds = clock.perf_counter() - begun
        with Record(path) as record:
            steps = int(record.steps[-1])
        runs.append(
            SceneRun(
                name=name,
                record=path,
                seconds=seconds,
                steps=steps,
                particles=simulation.particles.count,
                pairs=simulation.dynamics.internal.pair_count,
                outcome=outcome,
            )
        )
    with ExitStack() as stack:
        records: Mapping[str, Record] = {
            run.name: stack.enter_context(Record(run.record)) for run in runs
        }
        measurements = case.measure(records)
        pictures = case.draw(records, folder)
        tables = [
            _written(folder / f"{name}.csv", curves)
            for name, curves in case.curves(records).items()
        ]
    return CaseResult(measurements, runs, pictures, tables, peak_memory())


def _written(path: Path, curves: Curves) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    values = np.column_stack(list(curves.values()))
    np.savetxt(path, values, "%.9g", delimiter=",", header=",".join(curves), comments="")
    return path


def _told(cause: DivergedError | ConvergenceError) -> str:
    if isinstance(cause, DivergedError):
        return f"diverged at step {cause.step}: {cause.cause}"
    return f"no equilibrium beyond load factor {cause.load_factor:g}: {cause.cause}"
