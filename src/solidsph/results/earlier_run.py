"""The earlier run whose record is where a new one is to be written."""

from __future__ import annotations

from pathlib import Path

import attrs

from solidsph.errors import RecordError
from solidsph.results.layout import RUNNING
from solidsph.results.record import Record
from solidsph.results.record_file import check_writable
from solidsph.results.record_kind import NotARecordError, check_is_record
from solidsph.run.outcome import FINISHED, INTERRUPTED, is_over

# Outcomes of runs that would come to the same end again.
_ENDED = (FINISHED, "diverged", "unsound", "ConvergenceError")


@attrs.frozen
class EarlierRun:
    """An earlier run, as far as its record tells."""

    outcome: str = ""  # empty if the record cannot be read
    count: int = 0  # number of outputs
    last_time: float = 0.0  # of the last output [s]

    @property
    def can_resume(self) -> bool:
        """True if `resume` can go on with it, so that replacing it would lose work."""
        return self.count > 1 and not self.outcome.startswith(_ENDED)

    @property
    def description(self) -> str:
        """Description in words."""
        if not self.outcome:
            return "a record that cannot be read"
        end = f"up to t = {self.last_time:.6g} s"
        if self.outcome in (RUNNING, INTERRUPTED):
            return f"an interrupted run {end}"
        if is_over(self.outcome):
            return f"{'a finished' if self.outcome == FINISHED else 'an unsound'} run {end}"
        return f"a run {end} that ended early ({self.outcome.split(':')[0]})"


def check_no_other_file(path: Path) -> None:
    """Raise RecordError if anything other than a record is there, which must not be replaced."""
    check_writable(path, overwrite=True)
    if not _has_content(path):
        return
    try:
        check_is_record(path)
    except NotARecordError as cause:
        raise RecordError(
            f"{cause}; it is not replaced: choose another place, or move it away"
        ) from None


def _has_content(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 0


def earlier_run_at(path: Path) -> EarlierRun | None:
    """The run whose record is there; None if the file is missing or empty.

    Raises:
        RecordError: there is something other than a record, which must not be replaced.
    """
    check_no_other_file(path)
    if not _has_content(path):
        return None
    try:
        with Record(path) as record:
            last_time = float(record.times[-1]) if record.count else 0.0
            return EarlierRun(record.outcome, record.count, last_time)
    except RecordError:
        return EarlierRun()


def check_replaceable(path: Path, *, overwrite: bool) -> EarlierRun | None:
    """The run that a new one may replace; None if nothing is there.

    Raises:
        RecordError: it is no record, or, without `overwrite`, a run that can be resumed.
    """
    earlier = earlier_run_at(path)
    if earlier is not None and earlier.can_resume and not overwrite:
        raise RecordError(
            f"{path} holds {earlier.description}; go on with it (solidsph resume {path}), or "
            "replace it (--overwrite), or record into another place (--output)"
        )
    return earlier
