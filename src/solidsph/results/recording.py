"""Recording: who writes the record of a run, and its checkpoint."""

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
    """Listeners of a run that write `record`; within it, no other run does.

    Raises:
        RecordError: another run writes the record.
    """
    # From the first state on, a run has no use for a checkpoint of another.
    goes_on = since is not None and since.state is not None
    with sole_writer(record):
        yield Checkpointer(record, is_resumed=goes_on), Recorder(record, since)
