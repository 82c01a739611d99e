"""Processes: parallel tasks on this machine, each in its own process."""

from __future__ import annotations

import selectors
from collections import deque
from collections.abc import Sequence
from typing import final

import attrs

from solidsph.errors import SceneError
from solidsph.studies.fresh_process import FreshProcess
from solidsph.studies.runner import Outcomes, Runner
from solidsph.studies.task import Task
from solidsph.studies.task_lines import decode_outcome, encode_task


@final
@attrs.frozen
class Processes(Runner):
    """Runs tasks in parallel; a crash of one does not affect the others."""

    workers: int  # tasks at a time

    def __attrs_post_init__(self) -> None:
        if self.workers < 1:
            raise SceneError(f"workers must be at least 1, got {self.workers}")

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        waiting = deque(
            [(task, encode_task(task)) for task in tasks]
        )  # refused before any of them begins
        running: dict[FreshProcess, Task] = {}
        with selectors.DefaultSelector() as ready:
            try:
                while waiting or running:
                    while waiting and len(running) < self.workers:
                        task, line = waiting.popleft()
                        process = FreshProcess(line)
                        running[process] = task
                        ready.register(process, selectors.EVENT_READ)
                    for key, _ in ready.select():
                        process = key.fileobj  # type: ignore[assignment]  # what was registered
                        if process.is_over():
                            ready.unregister(process)
                            task = running[process]
                            reply = process.reply()
                            process.close()
                            del running[process]
                            yield task, decode_outcome(reply, task)
            finally:
                for process in running:
                    process.close()
