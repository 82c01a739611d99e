"""Time left: what remains of a sweep takes as long as what is finished did, scaled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp, inf, isfinite, log
from statistics import median

import attrs
import numpy as np

from solidsph.errors import SolidsphError
from solidsph.studies.case_run import FINISHED
from solidsph.studies.point import Point
from solidsph.studies.task import Task
from solidsph.studies.variant import with_settings

# Of time with one over the spacing, as long as no two spacings have been timed: particles and
# steps in two dimensions.
_EXPONENT = 3.0
_STEEPEST = 6.0  # a fit to two noisy times may say anything


@attrs.frozen
class RemainingTime:
    """How long tasks take, from those that have been timed.

    Known of a task is its spacing; times follow a power of it, fitted to what is finished. Other
    settings count for nothing, unless the same configuration has been timed.
    """

    spacings: Mapping[str, float]  # of each configuration [m]; infinite if unknown
    times: dict[str, list[float]] = attrs.field(factory=dict)  # of configurations [s]

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> RemainingTime:
        """One that knows of no times yet."""
        first = {task.configuration: task for task in tasks}
        return cls({name: _spacing(task) for name, task in first.items()})

    def learn(self, task: Task, point: Point) -> None:
        """Take note of how long a task took; one that failed says nothing."""
        if point.outcome == FINISHED and isfinite(point.time):
            self.times.setdefault(task.configuration, []).append(point.time)

    def left(self, elapsed: float, done: Sequence[Task], remaining: Sequence[Task]) -> float | None:
        """Wall time until all is finished [s]; None as long as there is nothing to go by.

        Args:
            elapsed: wall time that `done` took, as many at a time as it will be [s].
            done: what has ended in this time.
            remaining: what has not. What is under way is taken for not begun, so that the first
                estimates are long where many run at a time.
        """
        if not remaining:
            return 0.0
        if not self.times or not done:
            return None
        exponent = self._exponent()
        taken = sum(self._time(task, exponent) for task in done)
        return elapsed * sum(self._time(task, exponent) for task in remaining) / taken

    def _time(self, task: Task, exponent: float) -> float:
        """Expected of one task by itself [s]."""
        name = task.configuration
        if name in self.times:
            return median(self.times[name])
        spacing = self.spacings[name]
        ratios = {other: self._ratio(other, spacing) for other in self.times}
        nearest = min(abs(log(ratio)) for ratio in ratios.values())
        scaled = [
            median(self.times[other]) * exp(exponent * log(ratio))
            for other, ratio in ratios.items()
            if abs(log(ratio)) == nearest
        ]
        return median(scaled)

    def _ratio(self, other: str, spacing: float) -> float:
        """How many times as fine `spacing` is [-]; 1 if nobody knows."""
        ratio = self.spacings[other] / spacing
        return ratio if isfinite(ratio) and ratio > 0.0 else 1.0

    def _exponent(self) -> float:
        known = [
            (log(self.spacings[name]), log(max(median(times), 1e-9)))
            for name, times in self.times.items()
            if isfinite(self.spacings[name])
        ]
        h, t = (np.array(column) for column in zip(*known, strict=True)) if known else ([0], [0])
        if np.ptp(h) < log(1.01):  # one spacing only
            return _EXPONENT
        return float(np.clip(-np.polyfit(h, t, 1)[0], 0.0, _STEEPEST))


def _spacing(task: Task) -> float:
    try:
        return with_settings(task.case, task.settings).resolution
    except (SolidsphError, ValueError):
        return inf  # refused settings, or no particles
