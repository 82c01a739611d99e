"""Temporary folders that are removed even if their process is killed."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time as clock
from pathlib import Path

_PREFIX = "solidsph-scratch-"
_YOUNG = 60.0  # age below which a folder may not be locked yet [s]


class ScratchFolder:
    """A folder that `close` removes; after a kill, the next one created removes it."""

    def __init__(self) -> None:
        _remove_abandoned(Path(tempfile.gettempdir()))
        self._folder = tempfile.TemporaryDirectory(prefix=_PREFIX)
        self.path = Path(self._folder.name)
        self._lock = os.open(self.path, os.O_RDONLY)
        fcntl.flock(self._lock, fcntl.LOCK_EX)  # released by the system when the process ends

    def close(self) -> None:
        """Remove the folder with its contents."""
        self._folder.cleanup()
        os.close(self._lock)


def _remove_abandoned(place: Path) -> None:
    for folder in place.glob(f"{_PREFIX}*"):
        try:
            if clock.time() - folder.stat().st_mtime < _YOUNG:
                continue
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        except OSError:
            continue  # of another user, or gone
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
        except BlockingIOError:
            pass  # in use
        finally:
            os.close(lock)
