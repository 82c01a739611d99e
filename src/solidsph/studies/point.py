"""Point: error and cost of one configuration of a case."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Mapping, Sequence
from math import inf, isfinite
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import attrs
from attrs.converters import optional

from solidsph.costs.process import peak_memory
from solidsph.errors import SolidsphError
from solidsph.run.outcome import FINISHED
from solidsph.studies.case import Case
from solidsph.studies.case_run import open_records, run_scenes
from solidsph.studies.variant import with_settings
from solidsph.system.compile_time import COMPILE_TIME


def _floats(values: Iterable[float]) -> tuple[float, ...]:
    return tuple(map(float, values))


def _pairs(values: Mapping[str, Iterable[float]]) -> dict[str, tuple[float, float]]:
    pairs = {}
    for name, pair in values.items():
        value, scale = _floats(pair)
        pairs[name] = (value, scale)
    return pairs


@attrs.frozen
class Point:
    """Error and cost of one configuration. All but time and memory are machine-independent."""

    settings: Mapping[str, Any]  # parameters that differ from the case's own
    error: float = attrs.field(converter=float)  # relative [-]; infinite if the run failed
    outcome: str = attrs.field(default=FINISHED, converter=str)  # or the reason of the failure
    quantity: str = attrs.field(default="", converter=str)  # that the error is of
    value: float | None = attrs.field(default=None, converter=optional(float))  # measured
    reference: float | None = attrs.field(default=None, converter=optional(float))
    spacing: float = attrs.field(default=inf, converter=float)  # of the particles [m]
    particles: int = attrs.field(default=0, converter=int)
    steps: int = attrs.field(default=0, converter=int)
    pair_evaluations: int = attrs.field(default=0, converter=int)  # those of effects included
    bytes_touched: int = attrs.field(default=0, converter=int)  # in all evaluations, at least
    seconds: Sequence[float] = attrs.field(default=(inf,), converter=_floats)  # of repeats [s]
    peak_memory: int = attrs.field(default=0, converter=int)  # of the largest process [bytes]
    values: Mapping[str, tuple[float, float]] = attrs.field(factory=dict, converter=_pairs)
    """Value and scale of every quantity without a reference, by name."""

    @property
    def time(self) -> float:
        """Median wall time, without that of compiling what is not on disk [s]."""
        return median(self.seconds)

    @property
    def ran(self) -> bool:
        """Whether the run finished, with a known error or not."""
        return self.outcome == FINISHED

    @property
    def finished(self) -> bool:
        """Whether the run finished with a finite error."""
        return self.ran and isfinite(self.error)

    @property
    def failure(self) -> str:
        """Why the run failed, in one line: of several problems the first."""
        first, *others = self.outcome.splitlines()
        return f"{first} {others[0].strip(' -')}" if first.endswith(":") and others else first

    def label(self) -> str:
        """Settings in one line."""
        return label(self.settings)

    def brief(self) -> str:
        """Settings, error and time in one line."""
        return f"{self.label()}: {percent(self.error)} in {self.time:.2g} s"


def percent(error: float) -> str:
    """An error in per cent, to two digits."""
    return f"{100.0 * error:.{2 if error < 0.995 else 4}g} %"


def measured(points: Sequence[Point]) -> Sequence[Mapping[str, Any]]:
    """Rows of a table: what runs without a reference have measured, those that finished."""
    return [
        {
            "configuration": point.label(),
            "time [s]": point.time,
            "quantity": quantity,
            "value": value,
        }
        for point in points
        if point.ran
        for quantity, (value, _) in point.values.items()
    ]


def run_point(case: Case, settings: Mapping[str, Any]) -> Point:
    """Run `case` with these settings once, in this process and a temporary folder.

    A failed run is a point with an infinite error.
    """
    begun = _clock()
    try:
        variant = with_settings(case, settings)
        with TemporaryDirectory() as folder:
            runs = run_scenes(variant, Path(folder))
            seconds = _clock() - begun
            with open_records(runs) as records:
                measured = variant.measure(records)
                headline = variant.accuracy(measured)
            if not runs:  # the measurement is all the work
                seconds = _clock() - begun
        failed = [run.outcome for run in runs if run.outcome != FINISHED]
        return Point(
            settings=dict(settings),
            error=inf if failed or headline.error is None else abs(headline.error),
            outcome=failed[0] if failed else FINISHED,
            quantity=headline.quantity,
            value=headline.value,
            reference=headline.reference,
            spacing=min((run.spacing for run in runs), default=variant.resolution),
            particles=sum(run.particles for run in runs),
            steps=sum(run.steps for run in runs),
            pair_evaluations=sum(run.pairs_visited * run.evaluations for run in runs),
            bytes_touched=sum(run.bytes_touched * run.evaluations for run in runs),
            seconds=(seconds,),
            peak_memory=peak_memory(),
            values={m.quantity: (m.value, m.scale) for m in measured if m.scale is not None},
        )
    except SolidsphError as cause:
        return Point(dict(settings), inf, outcome=str(cause))


def _clock() -> float:
    """Wall time of this process without that of compiling, which later runs do not need [s]."""
    return clock.perf_counter() - COMPILE_TIME.seconds


def merge_repeats(repeats: Sequence[Point]) -> Point:
    """One point of several runs of one configuration, which differ in time and memory only."""
    return attrs.evolve(
        repeats[0],
        seconds=[seconds for point in repeats for seconds in point.seconds],
        peak_memory=max(point.peak_memory for point in repeats),
    )


def label(settings: Mapping[str, Any]) -> str:
    """Names and values of settings in one line."""
    return ", ".join(f"{name} {format_setting(value)}" for name, value in settings.items())


def format_setting(value: Any) -> str:
    """Value of a setting as text."""
    return f"{value:g}" if isinstance(value, float) else str(value)
