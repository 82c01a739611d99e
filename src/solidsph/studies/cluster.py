"""Cluster: tasks on the workers of a Dask scheduler, each in its own process."""

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

_POLL = 0.5  # interval at which a worker checks whether its task is still wanted [s]


@final
@attrs.frozen
class Cluster(Runner):
    """Workers of a running scheduler; solidsph must be installed on each.

    A worker runs as many tasks at a time as it has threads: start it with one thread to measure
    times. Unfinished tasks of a worker that dies are run by another.
    """

    address: str  # of the scheduler, such as "tcp://host:8786"
    patience: float = 10.0  # longest wait for its answer [s]

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        distributed = _distributed()
        lines = [encode_task(task) for task in tasks]  # refused before any of them begins
        client = self._client(distributed)
        try:
            # Keys are unique, so that another client's task is never mistaken for one of these.
            futures = {
                client.submit(_on_worker, line, key=f"solidsph-{task.key}-{uuid.uuid4()}"): task
                for task, line in zip(tasks, lines, strict=True)
            }
            for future in distributed.as_completed(list(futures), loop=client.loop):
                if future.status not in ("finished", "error"):
                    raise SceneError(
                        f"the Dask scheduler at {self.address!r} is gone; finished points are "
                        "kept: restart it and give the same command"
                    )
                task = futures.pop(future)
                outcome = _outcome(future, task)
                future.release()  # otherwise the death of its worker would run it again
                yield task, outcome
        finally:
            client.close()  # the scheduler drops unfinished tasks, and workers end them

    def _client(self, distributed: Any) -> Any:
        try:
            if self.address.startswith(("tcp://", "tls://")) or "://" not in self.address:
                # A client that finds no scheduler is never closed, and its thread would remain.
                _wait_for_listener(
                    distributed.comm.get_address_host_port(self.address), self.patience
                )
            return distributed.Client(
                self.address, timeout=self.patience, set_as_default=False, name="solidsph"
            )
        except Exception as cause:  # of any kind: the other side may not be a scheduler at all
            raise SceneError(
                f"no Dask scheduler answers at {self.address!r} within {self.patience:g} s "
                f"({type(cause).__name__}: {cause}); start one with 'dask scheduler', or correct "
                "the address"
            ) from None


def _wait_for_listener(address: tuple[str, int], patience: float) -> None:
    """Wait until a process listens at a host and port.

    Raises:
        OSError: none does.
    """
    end = clock.monotonic() + patience
    while True:
        try:
            socket.create_connection(address, timeout=patience).close()
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
    """Run an encoded task in a fresh process on the machine of this worker."""
    process = FreshProcess(line)
    try:
        with selectors.DefaultSelector() as ready:
            ready.register(process, selectors.EVENT_READ)
            while not (ready.select(_POLL) and process.is_over()):
                if not _is_wanted():
                    return encode_outcome(Lost("the sweep no longer waits for it"))
        return process.reply()
    finally:
        process.close()


def _is_wanted() -> bool:
    """Whether the sweep still waits for the task of this thread.

    When the client is gone, the worker only marks a task that has begun, and does not end it.
    """
    worker = _distributed().get_worker()
    task = worker.state.tasks.get(worker.get_current_task())
    return task is not None and task.state != "cancelled"
