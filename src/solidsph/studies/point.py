"""Point: what one configuration of a case costs, and how far it is from the reference."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from math import inf, isfinite
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import attrs

from solidsph.costs.process import peak_memory
from solidsph.errors import SolidsphError
from solidsph.studies.case import Case
from solidsph.studies.case_run import FINISHED, open_records, run_scenes
from solidsph.studies.variant import with_settings


@attrs.frozen
class Point:
    """Error and cost of one configuration. Its costs but for time and memory hang on no machine."""

    settings: Mapping[str, Any]  # what differs from the case's own parameters
    error: float  # relative to the reference [-]; infinite if the run failed
    outcome: str = FINISHED  # or why it failed
    quantity: str = ""  # what the error is of
    value: float | None = None  # what was measured of it
    reference: float | None = None  # and what it should be; None if the error is all there is
    spacing: float = inf  # of the particles [m]
    particles: int = 0
    steps: int = 0
    pair_evaluations: int = 0  # pairs visited in all evaluations, those of effects included
    bytes_touched: int = 0  # that all evaluations must move at least
    seconds: Sequence[float] = (inf,)  # wall time of every repeat [s]
    peak_memory: int = 0  # largest of a whole process [bytes]

    @property
    def time(self) -> float:
        """Median wall time [s]."""
        return median(self.seconds)

    @property
    def finished(self) -> bool:
        """Whether it has an error to speak of."""
        return self.outcome == FINISHED and isfinite(self.error)

    def label(self) -> str:
        """Its settings in one line."""
        return ", ".join(f"{name} {format_setting(value)}" for name, value in self.settings.items())


def run_point(case: Case, settings: Mapping[str, Any]) -> Point:
    """Run `case` with these settings once, in this process, in a folder that is then removed.

    A run that goes wrong is a point too: its error is infinite.
    """
    begun = clock.perf_counter()
    try:
        wanted = with_settings(case, settings)
        with TemporaryDirectory() as folder:
            runs = run_scenes(wanted, Path(folder))
            seconds = clock.perf_counter() - begun
            with open_records(runs) as records:
                headline = wanted.accuracy(wanted.measure(records))
            if not runs:  # then to measure is all there is to do
                seconds = clock.perf_counter() - begun
        failed = [run.outcome for run in runs if run.outcome != FINISHED]
        return Point(
            settings=dict(settings),
            error=inf if failed or headline.error is None else abs(headline.error),
            outcome=failed[0] if failed else FINISHED,
            quantity=headline.quantity,
            value=headline.value,
            reference=headline.reference,
            spacing=wanted.resolution,
            particles=sum(run.particles for run in runs),
            steps=sum(run.steps for run in runs),
            pair_evaluations=sum(run.pairs_visited * run.evaluations for run in runs),
            bytes_touched=sum(run.bytes_touched * run.evaluations for run in runs),
            seconds=(seconds,),
            peak_memory=peak_memory(),
        )
    except SolidsphError as cause:
        return Point(dict(settings), inf, outcome=str(cause))


def merge_repeats(repeats: Sequence[Point]) -> Point:
    """One point of several runs of one configuration, which differ in time and memory only."""
    return attrs.evolve(
        repeats[0],
        seconds=tuple(one for point in repeats for one in point.seconds),
        peak_memory=max(point.peak_memory for point in repeats),
    )


def format_setting(value: Any) -> str:
    """A setting as a person would write it."""
    return f"{value:g}" if isinstance(value, float) else str(value)
