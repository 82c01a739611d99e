"""Runner: where the tasks of a sweep are carried out."""

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
    """A task that gave no point, because its process died or its code is broken."""

    cause: str

    def point(self, task: Task) -> Point:
        """A failed point in its place."""
        return Point(dict(task.settings), inf, outcome=self.cause)


Outcomes: TypeAlias = Generator[tuple[Task, Point | Lost], None, None]
"""Tasks as they end, in no order. Closing it ends what still runs."""


class Runner(ABC):
    """Carries out tasks, each once, wherever it is."""

    @abstractmethod
    def run(self, tasks: Sequence[Task]) -> Outcomes:
        """Begin with the first tasks, and give each with what came of it as it ends."""


@final
@attrs.frozen
class Inline(Runner):
    """One after the other in this process, whose memory they share: for tests and tiny cases."""

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        for task in tasks:
            yield task, run_task(task)


def run_task(task: Task) -> Point | Lost:
    """Run the task in this process; an error that is no result of a run is told, not raised."""
    try:
        return run_point(task.case, task.settings)
    except Exception as cause:
        return Lost(f"{type(cause).__name__}: {cause}")
