"""The file that a record is written to: whether it may be written, and has room to grow."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from solidsph.errors import RecordError
from solidsph.results.layout import HDF5_ERRORS, reason


@contextmanager
def explained(problem: str, remedy: str) -> Iterator[None]:
    """Replace an error of the file system or of HDF5 by a RecordError with a clear message."""
    try:
        yield
    except HDF5_ERRORS as error:
        raise RecordError(f"{problem}: {reason(error)}; {remedy}") from None


def check_space(path: Path, size: int) -> None:
    """Raise OSError if a device, quota or limit has no room for `size` more bytes of a file.

    This is found without HDF5, which a failed write would damage.
    """
    if not hasattr(os, "posix_fallocate"):
        return
    with path.open("ab") as file:
        end = os.fstat(file.fileno()).st_size
        try:
            os.posix_fallocate(file.fileno(), end, size)
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
                raise
        finally:
            os.ftruncate(file.fileno(), end)


def check_writable(path: Path, *, overwrite: bool) -> None:
    """Raise RecordError unless a record may be written to `path`, or may `overwrite` a file."""
    if path.is_dir():
        example = path / "result.vtkhdf"
        raise RecordError(f"{path} is a folder, not a file; write to {example} for example")
    if not path.exists():
        return
    if not path.is_file():
        raise RecordError(f"{path} is not a regular file and is not replaced; choose another path")
    if not overwrite:
        raise RecordError(f"{path} exists already; choose another path or allow overwriting it")
    # A new file could take its place, but its owner has made it read-only.
    with explained(f"{path} may not be replaced", "choose another path or make it writable"):
        path.open("r+b").close()
