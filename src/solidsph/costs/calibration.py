"""Calibration: what this machine does in a second, measured in about one second.

In a process of its own, so that the memory of whoever asks stays what it is, and imports and the
first compilation are really first.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time as clock
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import attrs

# A cached calibration is used for so long [s]: a machine's neighbours and its cooling change.
_STALE = 86400.0

# What no calibration may take [s]; it takes about one.
_LONGEST = 20.0


CACHE = "SOLIDSPH_CACHE"
"""Environment variable: the folder of the cache, in place of the user's own."""


@attrs.frozen
class Calibration:
    """Times of small tasks on one machine, each the best of several."""

    sparse: float  # of an entry in a product of a sparse matrix with vectors that caches hold [s]
    calls: float  # of a call of a small array function [s]
    compiling: float  # of a small function, once the compiler is there [s]
    copying: float  # of a byte beyond the caches, read and written, by one thread [s]
    copying_shared: float  # of the same by as many threads as there are cores [s]
    threads: int  # as many
    filing: float  # of a byte appended to a file of the record's kind [s]
    appending: float  # of a small step appended to it, flushed [s]
    bare: int  # memory of the process after the imports of a run [bytes]

    def to_json(self) -> str:
        """Text from which an equal one is read."""
        return json.dumps(attrs.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Calibration:
        """From text.

        Raises:
            ValueError: it is not that of a calibration.
        """
        table = json.loads(text)
        fields = {field.name: field.type for field in attrs.fields(cls)}
        if not isinstance(table, dict) or set(table) != set(fields):
            raise ValueError("not a calibration of this version")
        for name, value in table.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
                raise ValueError(f"calibration: {name} = {value!r} is no positive number")
        return cls(**table)


@cache
def this_machine() -> Calibration:
    """The calibration of this machine: of this process, of a file of the last day, or anew."""
    found = kept()
    if found is None:
        found = calibrated()
        _keep(cache_file(), found)
    return found


def kept() -> Calibration | None:
    """What the cache file holds; nothing if it is old, broken or not there."""
    path = cache_file()
    try:
        # Files may be served by a machine whose clock is ahead of this one's.
        if abs(clock.time() - path.stat().st_mtime) > _STALE:
            return None
        return Calibration.from_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def calibrated() -> Calibration:
    """Measured now, in a process of its own."""
    command = [sys.executable, "-m", "solidsph.costs.yardsticks"]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=_LONGEST, env=_environment()
    )
    return Calibration.from_json(done.stdout)


def _environment() -> dict[str, str]:
    # What the caller has set for its own threads and plugins is not for this.
    return {name: value for name, value in os.environ.items() if name != "PYTHONWARNINGS"}


def cache_file() -> Path:
    """Where the calibration of this machine and this version is kept."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(os.environ.get(CACHE) or Path(home) / "solidsph")
    machine = f"{platform.node()}-{platform.machine()}-{os.cpu_count()}"
    safe = "".join(sign if sign.isalnum() or sign in "-." else "_" for sign in machine)
    return folder / f"calibration-{version('solidsph')}-{safe}.json"


def _keep(path: Path, found: Calibration) -> None:
    """In one piece or not at all; a machine without a place for it does without."""
    draft = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(found.to_json(), encoding="utf-8")
        draft.replace(path)
    except OSError:
        with suppress(OSError):
            draft.unlink()


def best(
    task: Callable[[], Any], repeats: int, ticks: Callable[[], float] = clock.process_time
) -> float:
    """Shortest time of several [s]: what the machine can do where nobody disturbs it.

    By the clock of the processor, unless several threads share the task.
    """
    times = []
    for _ in range(repeats):
        begun = ticks()
        task()
        times.append(ticks() - begun)
    return min(times)
