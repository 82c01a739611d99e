"""Cluster: tasks on the workers of a Dask scheduler, each there in a process of its own."""

from __future__ import annotations

import selectors
import socket
import time as clock
import uuid
from collections.abc import Sequence
from importlib import import_module
from typing import Any, final

import attrs

from solidsph.errors import SceneError
from solidsph.studies.fresh_process import FreshProcess
from solidsph.studies.point import Point
from solidsph.studies.runner import Lost, Outcomes, Runner
from solidsph.studies.task import Task
from solidsph.studies.task_lines import decode_outcome, encode_outcome, encode_task

_LOOK = 0.5  # how often a worker looks whether a task is still wanted [s]


@final
@attrs.frozen
class Cluster(Runner):
    """The workers of a scheduler that runs already; solidsph must be installed on each.

    A worker carries out as many tasks at a time as it has threads: start it with one where times
    are to be measured. What a worker that dies has not finished, another does.
    """

    address: str  # of the scheduler, such as "tcp://host:8786"
    patience: float = 10.0  # to wait for it to answer [s]

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        distributed = _distributed()
        lines = [encode_task(task) for task in tasks]  # refused before any begins
        client = self._client(distributed)
        try:
            # A name of its own each time: nobody else's task is taken for ours.
            futures = {
                client.submit(_on_worker, line, key=f"solidsph-{task.key}-{uuid.uuid4()}"): task
                for task, line in zip(tasks, lines, strict=True)
            }
            for future in distributed.as_completed(list(futures), loop=client.loop):
                if future.status not in ("finished", "error"):
                    raise SceneError(
                        f"the Dask scheduler at {self.address!r} is gone; what is finished is "
                        "kept: start it anew and give the same command"
                    )
                task = futures.pop(future)
                outcome = _outcome(future, task)
                future.release()  # or its worker's death would have it run again
                yield task, outcome
        finally:
            client.close()  # the scheduler forgets what is not finished, and workers end it

    def _client(self, distributed: Any) -> Any:
        try:
            if self.address.startswith(("tcp://", "tls://")) or "://" not in self.address:
                # A client that finds nobody is never closed; its thread would stay behind.
                _knock(distributed.comm.get_address_host_port(self.address), self.patience)
            return distributed.Client(
                self.address, timeout=self.patience, set_as_default=False, name="solidsph"
            )
        except Exception as cause:  # of any kind: what answers there may be no scheduler at all
            raise SceneError(
                f"no Dask scheduler answers at {self.address!r} within {self.patience:g} s "
                f"({type(cause).__name__}: {cause}); start one with 'dask scheduler', or correct "
                "the address"
            ) from None


def _knock(door: tuple[str, int], patience: float) -> None:
    """Wait until somebody listens at a host and port.

    Raises:
        OSError: nobody does.
    """
    end = clock.monotonic() + patience
    while True:
        try:
            socket.create_connection(door, timeout=patience).close()
            return
        except OSError:
            if clock.monotonic() > end:
                raise
            clock.sleep(0.1)


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError as cause:
        raise SceneError(
            f"a cluster needs Dask, which cannot be imported here ({cause}); install it with "
            "pip install 'solidsph[cluster]', here and on every worker"
        ) from None


def _outcome(future: Any, task: Task) -> Point | Lost:
    if future.status == "finished":
        return decode_outcome(future.result(), task)
    cause = future.exception()
    return Lost(f"on the cluster: {type(cause).__name__}: {cause}")


def _on_worker(line: str) -> str:
    """Carry out a packed task in a fresh process on the machine of this worker."""
    process = FreshProcess(line)
    try:
        with selectors.DefaultSelector() as ready:
            ready.register(process, selectors.EVENT_READ)
            while not (ready.select(_LOOK) and process.is_over()):
                if not _is_wanted():
                    return encode_outcome(Lost("nobody waits for it any more"))
        return process.reply()
    finally:
        process.close()


def _is_wanted() -> bool:
    """Whether the sweep that asked for the task of this thread still waits for it.

    A worker lets a task that has begun go on when its client is gone, and only marks it.
    """
    worker = _distributed().get_worker()
    task = worker.state.tasks.get(worker.get_current_task())
    return task is not None and task.state != "cancelled"
