"""Suite: hard cases, run and judged; some of them must fail, or the rest proves nothing."""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from solidsph.errors import SceneError, SolidsphError
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph.studies.case_run import FINISHED, SceneRun, open_records, run_scenes
from solidsph.studies.variant import with_settings

# Of the energy in play: beyond it energy comes from nowhere.
RESIDUAL = 1e-3


class Grade(Enum):
    """What became of a trial."""

    STABLE = "stable"
    DEGRADED = "degraded"  # it came through, but something is not as it must be
    FAILED = "failed"


@attrs.frozen
class Verdict:
    """The grade of one trial, and why."""

    case: str
    trial: str
    grade: Grade
    reason: str
    seconds: float  # wall time, building included [s]
    energy_residual: float  # largest, over the energy in play [-]; not a number if none moved
    must_fail: str  # why it must fail; empty if it must not
    known: str  # why it does not come through, where that is known

    @property
    def as_expected(self) -> bool:
        """Whether it is stable; a negative control, or a known exception, is expected not to be."""
        return (self.grade is Grade.STABLE) != bool(self.must_fail or self.known)


def trials(names: Sequence[str] = ()) -> Iterator[tuple[str, str, Case, Trial]]:
    """Case name, trial name, case and trial of all hard cases, or of those named.

    Raises:
        SceneError: a case of that name has no trials.
    """
    for name in names or registry.names("cases"):
        cls = registry.load("cases", name)
        if names and not cls.trials:
            raise SceneError(f"case {name!r} has no hard settings; solidsph stability --list")
        for label, trial in cls.trials.items():
            yield name, label, cls(), trial


def run_trial(
    name: str,
    label: str,
    case: Case,
    trial: Trial,
    folder: Path,
    *,
    words: Mapping[str, Any] | None = None,
    brief: bool = False,
) -> Verdict:
    """Run one trial and grade it.

    Args:
        words: other words of its scenes, as `with_settings` takes them, such as another kernel.
        brief: whether its short form is enough.
    """
    begun = clock.perf_counter()
    settings = {**trial.settings, **(trial.brief if brief else {}), **(words or {})}
    residual = float("nan")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # hard cases are what warnings are for
            wanted = with_settings(case, _understood(case, settings))
            runs = run_scenes(wanted, folder)
        conservative = {name for name, scene in wanted.scenes().items() if _has_energy(scene)}
        with open_records(runs) as records:
            residuals = [energy_residual(records[name]) for name in conservative]
            residual = max((one for one in residuals if isfinite(one)), default=residual)
            grade, reason = _graded(runs, wanted.measure(records), residual)
    except SolidsphError as cause:
        grade, reason = Grade.FAILED, " ".join(str(cause).split())
    return Verdict(
        case=name,
        trial=label,
        grade=grade,
        reason=reason,
        seconds=clock.perf_counter() - begun,
        energy_residual=residual,
        must_fail=trial.must_fail,
        known=trial.known,
    )


def _understood(case: Case, settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """`settings` as the case takes them: one without a strength of its own has an effect for it."""
    if "hourglass" not in settings or hasattr(case, "hourglass"):
        return settings
    rest = {name: value for name, value in settings.items() if name != "hourglass"}
    return {**rest, "hourglass-control.strength": settings["hourglass"]}


def _graded(
    runs: Sequence[SceneRun], measurements: Sequence[Measurement], residual: float
) -> tuple[Grade, str]:
    for run in runs:
        if run.outcome != FINISHED:
            return Grade.FAILED, run.outcome
    for one in measurements:
        if not one.passed:
            should = "" if one.reference is None else f", should be {one.reference:.4g}"
            said = f" ({one.verdict})" if one.verdict else ""
            return Grade.DEGRADED, f"{one.quantity}: {one.value:.4g} {one.unit}{should}{said}"
    if residual > RESIDUAL:
        return Grade.DEGRADED, f"energy comes from nowhere: {100.0 * residual:.2g} % of it"
    worst = max((one for one in measurements if one.error is not None), key=_error, default=None)
    return Grade.STABLE, "" if worst is None else f"{worst.quantity}: error {worst.error:.2g}"


def _error(measurement: Measurement) -> float:
    return measurement.error or 0.0


def _has_energy(scene: Scene) -> bool:
    """Whether its forces derive from one: sums without an adjoint keep none."""
    adjoint: bool = construct("formulations", scene.formulation).divergence.adjoint
    return adjoint


def energy_residual(record: Record) -> float:
    """Largest residual of the energy ledger over the energy in play [-]; nan if nothing moved."""
    history = {name: np.asarray(values) for name, values in record.history.items()}
    kinetic = history.get("kinetic energy [J]")
    if kinetic is None or not np.any(kinetic > 0.0):
        return float("nan")
    stored = [values for name, values in history.items() if name.endswith("energy [J]")]
    works = [np.abs(values) for name, values in history.items() if name.startswith("work of")]
    in_play = max(float(np.max(values)) for values in (sum(stored), *works))
    return float(np.abs(history["energy residual [J]"]).max()) / in_play
