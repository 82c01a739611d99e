"""Journal: the finished tasks of a sweep, one a line, which survives kills at any time."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import attrs

from solidsph.errors import RecordError
from solidsph.studies.point import Point
from solidsph.studies.task import Task
from solidsph.studies.task_lines import decode_point, encode_point

VERSION = 2
"""Version of the format. Lines of other versions are kept and ignored."""

Append = Callable[[Task, Point], None]
"""Appends the point of a task; the line is on the disk when it returns."""


@attrs.frozen
class Journal:
    """A file of JSON lines, one for each finished task. Nothing in it is ever changed.

    A line that is incomplete because its writer was killed is ignored, and ended by the next
    writer.
    """

    path: Path

    def points(self, tasks: Sequence[Task]) -> Mapping[str, Point]:
        """Points of these tasks in the file, by key."""
        if not self.path.exists():
            return {}
        wanted = {task.key: task for task in tasks}
        known: dict[str, Point] = {}
        for line in self.path.read_bytes().split(b"\n"):
            try:
                entry = json.loads(line)
                if entry["journal"] == VERSION and entry["key"] in wanted:
                    key = entry["key"]
                    known[key] = decode_point(entry["point"], wanted[key].settings)
            except (ValueError, KeyError, TypeError):
                continue
        return known

    @contextmanager
    def writer(self) -> Iterator[Append]:
        """Open the file to append points, in one process at a time.

        Raises:
            RecordError: another sweep is writing to it.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            _lock(file, self.path)  # released by the system when the process ends
            _sync_folder(self.path.parent)  # so that the file survives a loss of power

            def append(task: Task, point: Point) -> None:
                entry = {
                    "journal": VERSION,
                    "key": task.key,
                    "case": task.case.title,
                    "repeat": task.repeat,
                    "point": encode_point(point),
                }
                line = json.dumps(entry, allow_nan=False).encode("ascii") + b"\n"
                _write(file, line if _is_whole(file) else b"\n" + line)
                os.fsync(file)

            yield append
        finally:
            os.close(file)


def _lock(file: int, path: Path) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RecordError(
            f"another sweep is writing to {path}; wait until it ends, or name another folder"
        ) from None


def _sync_folder(folder: Path) -> None:
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def _is_whole(file: int) -> bool:
    """Whether the last line is complete."""
    size = os.fstat(file).st_size
    return size == 0 or os.pread(file, 1, size - 1) == b"\n"


def _write(file: int, data: bytes) -> None:
    while data:
        data = data[os.write(file, data) :]
