"""The machine: what it is, and what it can do at best, measured."""

from __future__ import annotations

import ctypes
import os
import platform
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import attrs
import numpy as np
from native import library, pointer
from table import Table
from timing import alternately

# Numbers in each array: many times what caches hold.
_LENGTH = 1 << 25
_STEPS = 5_000_000
_REPEATS = 7


@attrs.frozen
class Rates:
    """What a number of threads can do at best."""

    read: float  # [B/s]
    triad: float  # [B/s]
    multiply_adds: Mapping[str, float]  # by precision [1/s]


@cache
def rates(threads: int) -> Rates:
    """Measured once a process; the best of several, for it is a limit that is wanted."""
    kernels = library("machine.c")
    kernels.omp_set_num_threads(threads)
    kernels.read_all.restype = ctypes.c_double
    a, b, c = np.zeros(_LENGTH), np.ones(_LENGTH), np.ones(_LENGTH)
    length, steps, count = (ctypes.c_int64(n) for n in (_LENGTH, _STEPS, threads))
    done: dict[str, int] = {}

    def chains(precision: str) -> None:
        kernel = getattr(kernels, f"chains_{precision}")
        kernel.restype = ctypes.c_int64
        out = np.zeros(threads, dtype=precision)
        done[precision] = threads * kernel(steps, count, pointer(out))

    best = alternately(
        {
            "read": lambda: kernels.read_all(length, pointer(b)),
            "triad": lambda: kernels.triad(length, pointer(a), pointer(b), pointer(c)),
            "float64": lambda: chains("float64"),
            "float32": lambda: chains("float32"),
        },
        _REPEATS,
        of=min,
    )
    return Rates(
        read=b.nbytes / best["read"],
        triad=3 * b.nbytes / best["triad"],
        multiply_adds={name: done[name] / best[name] for name in ("float64", "float32")},
    )


def processor() -> str:
    """What the processor calls itself."""
    known = Path("/proc/cpuinfo")
    if known.exists():
        for line in known.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _company() -> str:
    """How many other programs there are to share the processor with."""
    if not hasattr(os, "getloadavg"):
        return ""
    load = os.getloadavg()[0]
    return f"When the run began {load:.1f} programs were running or waiting to (load average)."


def machine_table(threads: list[int]) -> Table:
    """What the machine can do, by the number of threads."""
    company = _company()
    rows = []
    for count in threads:
        rate = rates(count)
        rows.append(
            (
                f"{count}",
                f"{rate.read / 1e9:.1f}",
                f"{rate.triad / 1e9:.1f}",
                *(f"{rate.multiply_adds[name] / 1e9:.1f}" for name in ("float64", "float32")),
            )
        )
    return Table(
        f"The machine: {processor()}, {os.cpu_count()} cores",
        ("threads", "read GB/s", "triad GB/s", "1e9 multiply-adds/s", "the same, float32"),
        tuple(rows),
        f"Measured in the same run. A multiply-add is two floating point operations. {company}",
    )
