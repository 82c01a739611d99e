"""One writer at a time: a record, or the records of a case, belong to one run while it lasts.

The lock is the operating system's, on a small file beside the record that says who holds it. It is
gone with the process, however that ends; a file that is left behind then locks nothing.
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

try:
    import fcntl
except ImportError:  # not a system with these locks: there, nobody is kept out
    fcntl = None  # type: ignore[assignment]

_LONGEST = 300  # bytes of what a holder says of itself
_held: dict[int, int] = {}  # open lock file -> the process that locked it


@contextmanager
def sole_writer(path: Path) -> Iterator[None]:
    """Within it, no other run, of this process or another, writes `path`.

    Raises:
        RecordError: another one does; it names that one. Or the folder cannot be written.
    """
    lock = _lock_of(path)
    _check_lock(lock)
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        handle = _locked(lock)
    except BlockingIOError:
        raise RecordError(_refusal(path, lock)) from None
    except OSError as cause:
        raise RecordError(
            f"cannot create {path}: {cause.strerror or cause}; choose a path in a folder that you "
            "may write to"
        ) from None
    try:
        yield
    finally:
        _release(handle, lock)


def check_no_writer(path: Path) -> None:
    """That no run is writing `path` now.

    Raises:
        RecordError: one is; it names that one.
    """
    lock = _lock_of(path)
    _check_lock(lock)
    if fcntl is None or not lock.exists():
        return
    with suppress(FileNotFoundError, PermissionError), lock.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise RecordError(_refusal(path, lock)) from None
        except OSError:  # a file system without locks
            return


def _lock_of(path: Path) -> Path:
    real = Path(os.path.realpath(path))
    return real.with_name(f".{real.name}.lock")


def _check_lock(lock: Path) -> None:
    """That nothing else has its name: a link would lead to a file that is somebody's own, and a
    pipe would keep `open` waiting."""
    if lock.is_symlink() or (lock.exists() and not lock.is_file()):
        raise RecordError(
            f"{lock} is not a regular file, and has the name of the one by which a run keeps "
            "others from its record; move it away, or choose another place for the record"
        )


def _locked(lock: Path) -> int:
    """The lock file, open and locked.

    Raises:
        BlockingIOError: somebody else has locked it.
    """
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        try:
            if fcntl is not None:
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    raise
                except OSError:  # a file system without locks
                    pass
            # Its last holder may have removed it after it was opened here.
            there = os.fstat(handle)
            with suppress(FileNotFoundError):
                if os.path.samestat(there, lock.stat()):
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


def _release(handle: int, lock: Path) -> None:
    if _held.pop(handle, None) != os.getpid():
        return  # the fork of the process that holds it
    with suppress(OSError):
        lock.unlink()
    os.close(handle)


@cache
def _forget_in_forks() -> None:
    """A fork must not keep a lock when the process that took it has ended."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_forget)


def _forget() -> None:
    for handle in _held:
        os.close(handle)
    _held.clear()


def _refusal(path: Path, lock: Path) -> str:
    try:
        with lock.open("rb") as file:
            holder = file.read(_LONGEST).decode(errors="replace").strip()
    except OSError:
        holder = ""
    return (
        f"{path} is being written by another run ({holder or 'another process'}); wait until it "
        "has ended, or record into another file"
    )
