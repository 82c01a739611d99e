"""Remaining time of a sweep, extrapolated from finished tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp, inf, isfinite, log
from statistics import median

import attrs
import numpy as np

from solidsph.errors import SolidsphError
from solidsph.run.outcome import FINISHED
from solidsph.studies.point import Point
from solidsph.studies.task import Task
from solidsph.studies.variant import with_settings

# Power of one over the spacing by which time grows, until two spacings have been timed: particles
# and steps in 2D.
_EXPONENT = 3.0
_STEEPEST = 6.0  # limit of a fit to noisy times


@attrs.frozen
class RemainingTime:
    """Estimates of the times of tasks, from those that have been timed.

    Time follows a power of the spacing that is fitted to finished tasks. Other settings count only
    if the same configuration has been timed.
    """

    spacings: Mapping[str, float]  # of each configuration [m]; infinite if unknown
    times: dict[str, list[float]] = attrs.field(factory=dict)  # of each configuration [s]

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> RemainingTime:
        """Estimate without any times yet."""
        first = {task.configuration: task for task in tasks}
        return cls({name: _spacing(task) for name, task in first.items()})

    def learn(self, task: Task, point: Point) -> None:
        """Add the time of a task, unless it failed."""
        if point.outcome == FINISHED and isfinite(point.time):
            self.times.setdefault(task.configuration, []).append(point.time)

    def left(self, elapsed: float, done: Sequence[Task], remaining: Sequence[Task]) -> float | None:
        """Wall time until all tasks are finished [s]; None if nothing has been timed.

        Args:
            elapsed: wall time of `done`, with the same number of workers [s].
            done: tasks that have ended in this time.
            remaining: all others. Those under way count as not begun, so that early estimates are
                too long with many workers.
        """
        if not remaining:
            return 0.0
        if not self.times or not done:
            return None
        exponent = self._exponent()
        taken = sum(self._time(task, exponent) for task in done)
        return elapsed * sum(self._time(task, exponent) for task in remaining) / taken

    def _time(self, task: Task, exponent: float) -> float:
        """Expected time of one task by itself [s]."""
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
        """Spacing of another configuration over `spacing` [-]; 1 if unknown."""
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
        return inf  # settings are refused, or there are no particles
