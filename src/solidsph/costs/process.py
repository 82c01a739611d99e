"""Memory and load of this process and this machine, as the operating system reports them."""

from __future__ import annotations

import os
import resource
import sys
from contextlib import suppress
from pathlib import Path


def peak_memory() -> int:
    """Largest resident size of this process so far [bytes]."""
    # On Linux `getrusage` may report the peak of the parent process.
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM"):
                return 1024 * int(line.split()[1])
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def memory_now() -> int:
    """Resident size of this process [bytes]; its peak if the system does not report it."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return peak_memory()


def machine_memory() -> int:
    """Memory of this machine [bytes]."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def available_memory() -> int:
    """Memory available without swapping [bytes]; all memory if the system does not report it."""
    limits = [machine_memory()]
    status = Path("/proc/meminfo")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("MemAvailable"):
                limits.append(1024 * int(line.split()[1]))
    # A container may have less than its machine.
    limit, used = (Path("/sys/fs/cgroup") / name for name in ("memory.max", "memory.current"))
    with suppress(OSError, ValueError):  # no such file, or "max"
        limits.append(max(0, int(limit.read_text()) - int(used.read_text())))
    return min(limits)


def excess_load() -> float:
    """Load average beyond the number of cores; 0 if the system does not report it."""
    if not hasattr(os, "getloadavg"):
        return 0.0
    return max(0.0, os.getloadavg()[0] - (os.cpu_count() or 1))
