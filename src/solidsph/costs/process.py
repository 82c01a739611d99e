"""What the system tells of this process and this machine."""

from __future__ import annotations

import os
import resource
import sys
from contextlib import suppress
from pathlib import Path


def peak_memory() -> int:
    """Largest resident size of this process so far [bytes]."""
    # What `getrusage` tells on Linux may be that of the process that started this one.
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM"):
                return 1024 * int(line.split()[1])
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def memory_now() -> int:
    """Resident size of this process now [bytes]; its largest where the system does not tell."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return peak_memory()


def machine_memory() -> int:
    """Memory of this machine [bytes]."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def available_memory() -> int:
    """Memory that new work can take without swapping [bytes]; all there is where nobody tells."""
    found = [machine_memory()]
    status = Path("/proc/meminfo")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("MemAvailable"):
                found.append(1024 * int(line.split()[1]))
    # A container may have less than its machine.
    limit, used = (Path("/sys/fs/cgroup") / name for name in ("memory.max", "memory.current"))
    with suppress(OSError, ValueError):  # there is none, or it is "max"
        found.append(max(0, int(limit.read_text()) - int(used.read_text())))
    return min(found)


def company() -> float:
    """How many other programs want a core, beyond those that there are; 0 if nobody can tell."""
    if not hasattr(os, "getloadavg"):
        return 0.0
    return max(0.0, os.getloadavg()[0] - (os.cpu_count() or 1))
