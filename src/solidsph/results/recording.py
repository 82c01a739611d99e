"""The observers that record a run, and the lock that they hold."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from solidsph.results.checkpointer import Checkpointer
from solidsph.results.recorder import Recorder
from solidsph.results.sole_writer import sole_writer
from solidsph.run.restart_point import RestartPoint


@contextmanager
def recording(record: Path, since: RestartPoint | None) -> Iterator[tuple[Checkpointer, Recorder]]:
    """Observers of a run that write `record`; RecordError if another run writes it."""
    # A run from the first state has no use for an earlier checkpoint.
    is_resumed = since is not None and since.state is not None
    with sole_writer(record):
        yield Checkpointer(record, is_resumed=is_resumed), Recorder(record, since)
