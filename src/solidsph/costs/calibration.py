"""Calibration: speed of this machine at small tasks, measured in about one second.

The measurement runs in a separate process, so that it does not change the memory of the caller,
and so that imports and the first compilation are cold.
"""

from __future__ import annotations

import json
import logging
import os
import platform
import subprocess
import sys
import time as clock
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import attrs

from solidsph.system.cache import cache_folder, write_whole

LOG = logging.getLogger(__name__)

# Lifetime of a cached calibration [s]: the load and the cooling of a machine change.
_STALE = 86400.0

# Timeout of a calibration [s]; it takes about one.
_LONGEST = 20.0


@attrs.frozen
class Calibration:
    """Times of small tasks on one machine, each the best of several repeats."""

    sparse: float  # per entry of a sparse matrix product within the cache [s]
    calls: float  # per call of a small array function [s]
    compiling: float  # per small function, after the first [s]
    copying: float  # per byte copied beyond the caches, by one thread [s]
    copying_shared: float  # per byte copied by all threads together [s]
    threads: int
    filing: float  # per byte appended to a file like the record [s]
    appending: float  # per small step appended to it and flushed [s]
    bare: int  # memory of the process after the imports of a run [bytes]

    def to_json(self) -> str:
        """JSON text, read by `from_json`."""
        return json.dumps(attrs.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Calibration:
        """Read the text of `to_json`.

        Raises:
            ValueError: the text is no calibration of this version.
        """
        table = json.loads(text)
        fields = {field.name: field.type for field in attrs.fields(cls)}
        if not isinstance(table, dict) or set(table) != set(fields):
            raise ValueError("not a calibration of this version")
        for name, value in table.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
                raise ValueError(f"calibration: {name} = {value!r} is not a positive number")
        return cls(**table)


@cache
def this_machine() -> Calibration:
    """Calibration of this machine: from this process, from the cache file, or measured."""
    calibration = cached_calibration()
    if calibration is None:
        LOG.info("calibrating this machine, for predictions of time")
        calibration = measure_calibration()
        write_whole(cache_file(), calibration.to_json().encode())
    return calibration


def cached_calibration() -> Calibration | None:
    """Calibration in the cache file; None if it is old, broken or missing."""
    path = cache_file()
    try:
        # The clock of a file server may be ahead of this one.
        if abs(clock.time() - path.stat().st_mtime) > _STALE:
            return None
        return Calibration.from_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def measure_calibration() -> Calibration:
    """Measure in a separate process."""
    command = [sys.executable, "-m", "solidsph.costs.microbenchmarks"]
    # Warnings that the caller turned into errors must not end the measurement.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONWARNINGS"}
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=_LONGEST, env=environment
    )
    return Calibration.from_json(done.stdout)


def cache_file() -> Path:
    """Path of the cache file of this machine and this version."""
    machine = f"{platform.node()}-{platform.machine()}-{os.cpu_count()}"
    safe = "".join(sign if sign.isalnum() or sign in "-." else "_" for sign in machine)
    return cache_folder() / f"calibration-{version('solidsph')}-{safe}.json"


def best(
    task: Callable[[], Any], repeats: int, ticks: Callable[[], float] = clock.process_time
) -> float:
    """Shortest time of several repeats [s], least affected by other programs.

    The default clock is that of the processor; a task of several threads needs a wall clock.
    """
    times = []
    for _ in range(repeats):
        start = ticks()
        task()
        times.append(ticks() - start)
    return min(times)
