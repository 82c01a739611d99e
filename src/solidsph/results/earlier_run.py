"""What an earlier run has left where a new one is to be recorded."""

from __future__ import annotations

from pathlib import Path

import attrs

from solidsph.errors import RecordError
from solidsph.results.layout import RUNNING
from solidsph.results.record import NotARecordError, Record, check_is_record
from solidsph.results.record_writer import check_free
from solidsph.run.outcome import FINISHED, INTERRUPTED, is_over

# Outcomes of runs that would come to the same end again.
_ENDED = (FINISHED, "diverged", "unsound", "ConvergenceError")


@attrs.frozen
class EarlierRun:
    """An earlier run, as far as its record tells."""

    path: Path
    outcome: str = ""  # nothing if the record cannot be read
    count: int = 0  # outputs
    until: float = 0.0  # time of the last [s]
    scene: str = ""

    @property
    def can_go_on(self) -> bool:
        """Whether there is something that `resume` goes on with, and that would be lost."""
        return self.count > 1 and not self.outcome.startswith(_ENDED)

    def told(self) -> str:
        """What it is, in words."""
        if not self.outcome:
            return "a record that cannot be read"
        if self.outcome in (RUNNING, INTERRUPTED):
            return f"an interrupted run up to t = {self.until:.6g} s"
        if self.outcome == FINISHED:
            return f"a finished run up to t = {self.until:.6g} s"
        if is_over(self.outcome):
            return f"an unsound run up to t = {self.until:.6g} s"
        return f"a run up to t = {self.until:.6g} s that ended early ({self.outcome.split(':')[0]})"


def check_no_other_file(path: Path) -> None:
    """That a record may be written there, maybe in place of another record, but of nothing else.

    Raises:
        RecordError: there is something else.
    """
    check_free(path, overwrite=True)
    if not path.exists() or not path.stat().st_size:
        return
    try:
        check_is_record(path)
    except NotARecordError as cause:
        raise RecordError(
            f"{cause}; it is not replaced: choose another place, or move it away"
        ) from None


def earlier_run_at(path: Path) -> EarlierRun | None:
    """What is there; None if nothing is.

    Raises:
        RecordError: there is something that is no record, which a record must not replace.
    """
    check_no_other_file(path)
    if not path.exists() or not path.stat().st_size:
        return None
    try:
        with Record(path) as record:
            until = float(record.times[-1]) if record.count else 0.0
            return EarlierRun(path, record.outcome, record.count, until, record.scene)
    except RecordError:
        return EarlierRun(path)


def check_replaceable(path: Path, *, overwrite: bool) -> EarlierRun | None:
    """What a new run may take the place of; None if nothing is there.

    Raises:
        RecordError: it is no record, or, without `overwrite`, a run that can be gone on with.
    """
    left = earlier_run_at(path)
    if left is not None and left.can_go_on and not overwrite:
        raise RecordError(
            f"{path} holds {left.told()}; go on with it (solidsph resume {path}), or replace it "
            "(--overwrite), or record into another place (--output)"
        )
    return left
