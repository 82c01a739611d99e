"""Records that a command is given: a file, or a folder of them."""

from __future__ import annotations

from pathlib import Path

from solidsph.errors import RecordError
from solidsph.results.layout import RECORD_SUFFIXES


def records_in(path: Path) -> list[Path]:
    """The record at a path, or all records in a folder.

    Raises:
        RecordError: the folder has none.
    """
    if not path.is_dir():
        return [path]
    found = sorted(one for suffix in RECORD_SUFFIXES for one in path.glob(f"*{suffix}"))
    if not found:
        raise RecordError(f"there is no record (*.h5) in the folder {path}; check the path")
    return found
