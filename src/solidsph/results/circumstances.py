"""Circumstances: what, beside the scene, decides the bits of a run."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import TYPE_CHECKING

from solidsph import registry
from solidsph.results.layout import PluginUsed

if TYPE_CHECKING:
    from solidsph.simulation import Simulation

_SOFTWARE = ("solidsph", "numpy", "scipy", "numba")


def circumstances(simulation: Simulation) -> Mapping[str, str]:
    """Versions of software and of every part used, and how many threads share the work."""
    used = [
        PluginUsed(e.kind, e.name, e.distribution, e.version, e.target) for e in simulation.parts
    ]
    return {
        **{name: metadata.version(name) for name in _SOFTWARE},
        "python": platform.python_version(),
        "machine": platform.machine(),
        "threads": _threads(),
        **named_parts(used),
    }


def named_parts(used: Sequence[PluginUsed]) -> Mapping[str, str]:
    """ "kind name" of every part -> its distribution and version."""
    return {
        f"{registry.singular(part.group)} {part.name or part.target}": (
            f"{part.distribution or 'no distribution'} {part.version}".rstrip()
        )
        for part in used
    }


def _threads() -> str:
    """Sums are divided among them, here and in libraries for vectors."""
    wanted = os.environ.get("NUMBA_NUM_THREADS")
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{count}" if wanted is None else f"{count}, {wanted} of them compiled"


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> Sequence[str]:
    """What is not as it was, in words."""
    return [
        f"{name} was {then.get(name, 'not there')}, is {now.get(name, 'not there')}"
        for name in dict.fromkeys((*then, *now))
        if then.get(name) != now.get(name)
    ]
