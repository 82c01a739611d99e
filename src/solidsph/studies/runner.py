"""Runner: the place where the tasks of a sweep run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator, Sequence
from math import inf
from typing import TypeAlias, final

import attrs

from solidsph.studies.point import Point, run_point
from solidsph.studies.task import Task


@attrs.frozen
class Lost:
    """Outcome of a task whose process died or whose code is broken."""

    cause: str

    def point(self, task: Task) -> Point:
        """Failed point in place of the task's."""
        return Point(dict(task.settings), inf, outcome=self.cause)


Outcomes: TypeAlias = Generator[tuple[Task, Point | Lost], None, None]
"""Tasks with their outcomes as they end, in any order. Closing it ends those that still run."""


class Runner(ABC):
    """Runs every task once."""

    @abstractmethod
    def run(self, tasks: Sequence[Task]) -> Outcomes:
        """Start the tasks in order, and yield each with its outcome when it ends."""


@final
@attrs.frozen
class Inline(Runner):
    """Runs tasks one after the other in this process, for tests and tiny cases."""

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        for task in tasks:
            yield task, run_task(task)


def run_task(task: Task) -> Point | Lost:
    """Run the task in this process; an unexpected error is an outcome, and not raised."""
    try:
        return run_point(task.case, task.settings)
    except Exception as cause:
        return Lost(f"{type(cause).__name__}: {cause}")
