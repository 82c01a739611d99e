"""One writer at a time: a record, or the folder of a case, is locked by the run that writes it.

The lock is the operating system's, on a small file beside the record that names its holder. It ends
with the process, however that ends; a file that is left behind then locks nothing.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from functools import cache
from pathlib import Path

from solidsph.errors import RecordError
from solidsph.results.record_file import explained

try:
    import fcntl
except ImportError:  # a system without these locks
    fcntl = None  # type: ignore[assignment]

_LONGEST = 300  # bytes that are read of a lock file
_held: dict[int, int] = {}  # open lock file -> the process that locked it


@contextmanager
def sole_writer(path: Path) -> Iterator[None]:
    """Keep all other runs, of this process and of others, from writing `path`.

    Raises:
        RecordError: another run writes it; the message names its process. Or the folder cannot be
            written.
    """
    lock = _lock_of(path)
    with explained(f"cannot create {path}", "choose a path in a folder that you may write to"):
        lock.parent.mkdir(parents=True, exist_ok=True)
        handle = _locked(lock, path)
    try:
        yield
    finally:
        _release(handle, lock)


def check_no_writer(path: Path) -> None:
    """Raise RecordError if a run is writing `path` now; the message names its process."""
    lock = _lock_of(path)
    if fcntl is None or not lock.exists():
        return
    with suppress(FileNotFoundError, PermissionError), lock.open("rb") as file:
        _lock(file.fileno(), fcntl.LOCK_SH, lock, path)


def _lock_of(path: Path) -> Path:
    """The lock file of `path`: no link, which could lead to a file of the user's, and no pipe,
    which would keep `open` waiting."""
    real = Path(os.path.realpath(path))
    lock = real.with_name(f".{real.name}.lock")
    if lock.is_symlink() or (lock.exists() and not lock.is_file()):
        raise RecordError(
            f"{lock} is not a regular file, but has the name of a record's lock; move it away, "
            "or choose another place for the record"
        )
    return lock


def _locked(lock: Path, path: Path) -> int:
    """Open, lock and fill the lock file; returns its handle."""
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        try:
            if fcntl is not None:
                _lock(handle, fcntl.LOCK_EX, lock, path)
            # Its last holder may have removed it after it was opened here.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), lock.stat()):
                    break
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)
    now = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    os.ftruncate(handle, 0)
    os.write(handle, f"process {os.getpid()} on {socket.gethostname()}, since {now}\n".encode())
    _forget_in_forks()
    _held[handle] = os.getpid()
    return handle


def _lock(handle: int, kind: int, lock: Path, path: Path) -> None:
    """Lock an open file, if the file system has locks; RecordError if another run has done so."""
    try:
        fcntl.flock(handle, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        try:
            with lock.open("rb") as file:
                holder = file.read(_LONGEST).decode(errors="replace").strip()
        except OSError:
            holder = ""
        raise RecordError(
            f"{path} is being written by another run ({holder or 'another process'}); wait until "
            "it has ended, or record into another file"
        ) from None
    except OSError:  # a file system without locks
        return


def _release(handle: int, lock: Path) -> None:
    if _held.pop(handle, None) != os.getpid():
        return  # a fork of the process that holds it
    with suppress(OSError):
        lock.unlink()
    os.close(handle)


@cache
def _forget_in_forks() -> None:
    """Close the locks in forks: one must not keep a lock whose own process has ended."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_forget)


def _forget() -> None:
    for handle in _held:
        os.close(handle)
    _held.clear()
