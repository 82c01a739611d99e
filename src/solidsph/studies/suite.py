"""Suite of hard cases: trials that are run and graded. Some must fail, or it proves nothing."""

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
from solidsph.run.outcome import FINISHED
from solidsph.scene.scene import Scene
from solidsph.scene.scheme import completed
from solidsph.studies.case import Case, Measurement, Trial
from solidsph.studies.case_run import SceneRun, open_records, run_scenes
from solidsph.studies.variant import with_settings

# Largest energy residual of a stable trial, over the energy in play.
_RESIDUAL = 1e-3


class Grade(Enum):
    """Outcome of a trial."""

    STABLE = "stable"
    DEGRADED = "degraded"  # it finished, but a measurement or its energy is wrong
    FAILED = "failed"


@attrs.frozen
class Verdict:
    """Grade of a trial, and the reason."""

    case: str
    trial: str
    grade: Grade
    reason: str
    seconds: float  # wall time, building included [s]
    energy_residual: float  # largest, over the energy in play [-]; nan if nothing moved
    must_fail: str  # why it must fail; empty if it must not
    known: str  # why it is known not to be stable; empty if it should be

    @property
    def as_expected(self) -> bool:
        """Whether it is stable, or is not but must fail or is known to."""
        return (self.grade is Grade.STABLE) != bool(self.must_fail or self.known)


def trials(names: Sequence[str] = ()) -> Iterator[tuple[str, str, Case, Trial]]:
    """Case name, trial name, case and trial of all hard cases, or of the cases named.

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
    settings: Mapping[str, Any] | None = None,
    brief: bool = False,
) -> Verdict:
    """Run one trial and grade it.

    Args:
        name: of the case.
        label: of the trial.
        case: to be run.
        trial: its settings and expectations.
        folder: for records.
        settings: further ones, as `with_settings` takes them, such as another kernel.
        brief: whether to run its short form.
    """
    begun = clock.perf_counter()
    chosen = {**trial.settings, **(trial.brief if brief else {}), **(settings or {})}
    residual = float("nan")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # hard cases deserve their warnings
            variant = with_settings(case, chosen)
            runs = run_scenes(variant, folder)
        conservative = {name for name, scene in variant.scenes().items() if _has_energy(scene)}
        with open_records(runs) as records:
            residuals = [energy_residual(records[name]) for name in conservative]
            residual = max(filter(isfinite, residuals), default=residual)
            grade, reason = _graded(runs, variant.measure(records), residual)
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


def _graded(
    runs: Sequence[SceneRun], measurements: Sequence[Measurement], residual: float
) -> tuple[Grade, str]:
    for run in runs:
        if run.outcome != FINISHED:
            return Grade.FAILED, run.outcome
    for m in measurements:
        if not m.passed:
            should = "" if m.reference is None else f", should be {m.reference:.4g}"
            verdict = f" ({m.verdict})" if m.verdict else ""
            return Grade.DEGRADED, f"{m.quantity}: {m.value:.4g} {m.unit}{should}{verdict}"
    if residual > _RESIDUAL:
        return Grade.DEGRADED, f"the energy balance is off by {100.0 * residual:.2g} %"
    with_error = (m for m in measurements if m.error is not None)
    worst = max(with_error, key=lambda m: m.error or 0.0, default=None)
    return Grade.STABLE, "" if worst is None else f"{worst.quantity}: error {worst.error:.2g}"


def _has_energy(scene: Scene) -> bool:
    """Whether its forces conserve energy, as those of an adjoint divergence do."""
    adjoint: bool = construct("formulations", completed(scene).formulation).divergence.adjoint
    return adjoint


def energy_residual(record: Record) -> float:
    """Largest residual of the energy balance over the energy in play [-]; nan if nothing moved."""
    history = {name: np.asarray(values) for name, values in record.history.items()}
    kinetic = history.get("kinetic energy [J]")
    if kinetic is None or not np.any(kinetic > 0.0):
        return float("nan")
    stored = [values for name, values in history.items() if name.endswith("energy [J]")]
    works = [np.abs(values) for name, values in history.items() if name.startswith("work of")]
    in_play = max(float(np.max(values)) for values in (sum(stored), *works))
    return float(np.abs(history["energy residual [J]"]).max()) / in_play
