"""Files that a user names: regular ones of bounded size, found from the folder of the run."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_FOLDER: ContextVar[Path | None] = ContextVar("folder of relative paths", default=None)


def located(path: Path | str) -> Path:
    """Where the file is: a relative path begins in the folder of the run.

    That is the working folder, and of a run that is gone on with the one that it was begun in.
    """
    folder = _FOLDER.get()
    return Path(path) if folder is None else folder / path


def working_folder() -> Path:
    """Where relative paths begin."""
    return _FOLDER.get() or Path.cwd()


@contextmanager
def relative_to(folder: Path | None) -> Iterator[None]:
    """Within it, relative paths begin in `folder`; in the working folder if that is None."""
    token = _FOLDER.set(folder)
    try:
        yield
    finally:
        _FOLDER.reset(token)


def content(path: Path, most: int) -> bytes:
    """All bytes of a regular file.

    A pipe or a device could have no end, and a file may grow while it is read; neither is read
    beyond `most`.

    Args:
        path: of the file, or of a link to it.
        most: how many bytes it may have.

    Raises:
        OSError: it cannot be read, is no regular file, has more bytes, or is being changed.
    """
    # A pipe without a writer would otherwise keep `open` waiting.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode):
        os.close(handle)
        raise OSError(f"it is {_kind(found.st_mode)}, not a regular file")
    with os.fdopen(handle, "rb") as file:
        if found.st_size > most:
            raise OSError(f"it has {found.st_size:,} bytes, at most {most:,} are read")
        data = file.read(found.st_size)
        after = os.fstat(handle)
    if len(data) != found.st_size or after.st_size != found.st_size:
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
