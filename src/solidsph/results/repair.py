"""Makes a clean copy of a record whose writer was killed, for programs that refuse such a file."""

from __future__ import annotations

from pathlib import Path

from solidsph.errors import RecordError
from solidsph.results.layout import RUNNING
from solidsph.results.record import Record
from solidsph.results.record_writer import RecordWriter
from solidsph.run.outcome import INTERRUPTED


def repaired(path: Path, target: Path) -> int:
    """Copy every step that can be read into a new, closed record; returns their number.

    Args:
        path: a record, in any state that `Record` opens; it is left as it is.
        target: the copy, replaced if it exists. Its outcome is "interrupted" if `path` has none.

    Raises:
        RecordError: `path` cannot be read, or `target` not be written or is the same file.
    """
    path, target = Path(path), Path(target)
    if target.exists() and path.exists() and path.samefile(target):
        raise RecordError(f"{path} cannot be its own repaired copy; name another file")
    with Record(path) as record, RecordWriter(target, record.reference) as writer:
        for place in range(record.count):
            writer.append(record.output(place))
        writer.close(INTERRUPTED if record.outcome == RUNNING else record.outcome)
        return writer.count
