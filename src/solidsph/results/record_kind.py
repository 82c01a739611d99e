"""What kind of file is there: a record, another HDF5 file, or something else."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py

from solidsph.errors import RecordError
from solidsph.results.hdf5_source import SIGNATURE, HDF5Source, is_unclosed
from solidsph.results.layout import HDF5_ERRORS


class NotARecordError(RecordError):
    """The file is something else."""


def head_of(path: Path) -> bytes:
    """The first bytes of an HDF5 file."""
    if path.is_dir():
        raise RecordError(f"{path} is a folder, not a record; name the file in it")
    if not path.exists():
        raise RecordError(f"there is no record {path}; check the path, or run the scene first")
    if not path.is_file():  # a pipe would keep `open` waiting
        raise RecordError(f"{path} is not a regular file, so no record of solidsph")
    with path.open("rb") as file:
        head = file.read(64)
    if not head.startswith(SIGNATURE):
        raise NotARecordError(f"{path} is not an HDF5 file, so no record of solidsph")
    return head


def group_of_run(file: Any, path: Path) -> Any:
    """The group that VTK ignores."""
    link = file.get("solidsph", getlink=True)
    run = file["solidsph"] if isinstance(link, h5py.HardLink) else None
    if run is None or "format" not in run.attrs:
        raise NotARecordError(f"{path} is an HDF5 file, but not a record of solidsph")
    return run


def check_is_record(path: Path) -> None:
    """Raise NotARecordError unless a file is a record, damaged or not; little of it is read."""
    head_of(path)
    with suppress(*HDF5_ERRORS), HDF5Source(path) as opened, h5py.File(opened, "r") as file:
        group_of_run(file, path)


def may_change(path: Path) -> bool:
    """Whether a run may be writing it."""
    try:
        return is_unclosed(head_of(path))
    except (OSError, RecordError):
        return False
