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
    """Replace errors of the file system or of HDF5 by one clear message.

    Raises:
        RecordError: in place of such an error.
    """
    try:
        yield
    except HDF5_ERRORS as error:
        raise RecordError(f"{problem}: {reason(error)}; {remedy}") from None


def check_space(path: Path, size: int) -> None:
    """Check that a file can grow by `size` bytes, without HDF5, which a failed write would damage.

    Raises:
        OSError: the device is full, or a quota or a limit does not allow it.
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
    """Check that a record may be written to `path`; only `overwrite` allows to replace a file.

    Raises:
        RecordError: it may not.
    """
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
