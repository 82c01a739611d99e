"""Sweeps over the configurations of a case, which keep what is finished."""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Callable, Sequence
from contextlib import closing

import attrs

from solidsph.studies.journal import Journal
from solidsph.studies.point import Point, label, merge_repeats
from solidsph.studies.remaining_time import RemainingTime
from solidsph.studies.runner import Lost, Runner
from solidsph.studies.task import Task

LOG = logging.getLogger(__name__)


@attrs.frozen
class SweepStatus:
    """Progress of a sweep."""

    total: int  # tasks asked for
    kept: int  # of them finished by earlier sweeps
    done: int  # of them ended in this one
    seconds_left: float | None  # wall time [s]; None if unknown
    task: Task | None = None  # that has just ended
    outcome: Point | Lost | None = None  # of that task

    @property
    def remaining(self) -> int:
        """Tasks that have not ended."""
        return self.total - self.kept - self.done

    @property
    def point(self) -> Point | None:
        """Point of that task; a failed one if it was lost."""
        if isinstance(self.outcome, Lost):
            return None if self.task is None else self.outcome.point(self.task)
        return self.outcome


StatusCallback = Callable[[SweepStatus], None]
"""Called before the first task begins, and after every task."""


def ignore_status(standing: SweepStatus) -> None:
    pass


def sweep(
    tasks: Sequence[Task], runner: Runner, journal: Journal, watch: StatusCallback = ignore_status
) -> Sequence[Point]:
    """Run the `tasks` that are not in the journal, and add each to it when it ends.

    A sweep may be killed at any time; the same call continues it. A task that is lost, because its
    process died or its code is broken, is a failed point, and is run again by the next sweep.

    Returns:
        One point of all repeats of each configuration, in the order of the tasks.

    Raises:
        RecordError: another sweep is writing to the journal.
        SceneError: a task cannot be sent to the process that would run it.
    """
    wanted = {task.key: task for task in tasks}
    lost: dict[str, Lost] = {}
    with journal.writer() as append:
        points = dict(journal.points(tasks))
        kept = len(points)
        remaining = {key: task for key, task in wanted.items() if key not in points}
        estimate = RemainingTime.of(tasks)
        for key, point in points.items():
            estimate.learn(wanted[key], point)
        LOG.info("%d configurations, of which %d are in the journal", len(wanted), kept)
        done: list[Task] = []
        watch(SweepStatus(len(wanted), kept, 0, estimate.left(0.0, done, list(remaining.values()))))
        begun = clock.perf_counter()
        with closing(runner.run(list(remaining.values()))) as outcomes:
            for task, outcome in outcomes:
                if isinstance(outcome, Point):
                    append(task, outcome)
                    points[task.key] = outcome
                    estimate.learn(task, outcome)
                else:
                    lost[task.key] = outcome
                done.append(task)
                del remaining[task.key]
                elapsed = clock.perf_counter() - begun
                left = estimate.left(elapsed, done, list(remaining.values()))
                count = kept + len(done)
                LOG.info("%d of %d has ended: %s", count, len(wanted), label(task.settings))
                watch(SweepStatus(len(wanted), kept, len(done), left, task, outcome))
    return _merged(list(wanted.values()), points, lost)


def _merged(
    tasks: Sequence[Task], points: dict[str, Point], lost: dict[str, Lost]
) -> Sequence[Point]:
    repeats: dict[str, list[Task]] = {}
    for task in tasks:
        repeats.setdefault(task.configuration, []).append(task)
    return [
        # Lost repeats are left out if another finished.
        merge_repeats([points[task.key] for task in same if task.key in points])
        if any(task.key in points for task in same)
        else lost[same[0].key].point(same[0])
        for same in repeats.values()
    ]
