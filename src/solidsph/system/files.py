"""Files that a user names: regular, of bounded size, with paths relative to the run's folder."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_FOLDER: ContextVar[Path | None] = ContextVar("folder of relative paths", default=None)


def located(path: Path | str) -> Path:
    """Resolve a path: a relative one begins in the folder of the run.

    That is the working folder; of a resumed run, the one in which it was begun.
    """
    folder = _FOLDER.get()
    return Path(path) if folder is None else folder / path


def working_folder() -> Path:
    """Folder in which relative paths begin."""
    return _FOLDER.get() or Path.cwd()


@contextmanager
def relative_to(folder: Path | None) -> Iterator[None]:
    """Let relative paths begin in `folder`, within the block; None is the working folder."""
    token = _FOLDER.set(folder)
    try:
        yield
    finally:
        _FOLDER.reset(token)


def content(path: Path, most: int) -> bytes:
    """Read all bytes of a regular file, or of one behind a link.

    Pipes and devices are refused, since they could have no end.

    Raises:
        OSError: it cannot be read, is no regular file, has more than `most` bytes, or is being
            changed.
    """
    # A pipe without a writer would otherwise keep `open` waiting.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    before = os.fstat(handle)
    if not stat.S_ISREG(before.st_mode):
        os.close(handle)
        raise OSError(f"it is {_kind(before.st_mode)}, not a regular file")
    with os.fdopen(handle, "rb") as file:
        if before.st_size > most:
            raise OSError(f"it has {before.st_size:,} bytes, at most {most:,} are read")
        data = file.read(before.st_size)
        after = os.fstat(handle)
    if not len(data) == before.st_size == after.st_size:
        raise OSError("it changed while it was read; wait until it is complete")
    return data


def _kind(mode: int) -> str:
    kinds = {
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a pipe",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
        stat.S_IFSOCK: "a socket",
    }
    return kinds.get(stat.S_IFMT(mode), "something else")
