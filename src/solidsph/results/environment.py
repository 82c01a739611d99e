"""Circumstances: what, beside the scene, decides the bits of a run."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from solidsph.registry import registry
from solidsph.results.layout import PluginUsed

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene

_SOFTWARE = ("solidsph", "numpy", "scipy", "numba")
_CODE = "code of "


def circumstances(simulation: BuiltScene) -> Mapping[str, str]:
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
        **{f"{_CODE}{name}": digest for name, digest in _codes(used)},
    }


def is_part(name: str) -> bool:
    """Whether it is a part, which not every run uses."""
    return " " in name and not name.startswith(_CODE)


def _codes(used: Sequence[PluginUsed]) -> Iterator[tuple[str, str]]:
    """Digest of the code of every package that a part is in, or of its module where that is in
    none: its version may not tell a change, and what a part calls may be in another module."""
    for name in dict.fromkeys(_package(part.target.partition(":")[0]) for part in used):
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is None:
            continue
        is_package = hasattr(sys.modules[name], "__path__")
        files = sorted(Path(file).parent.rglob("*.py")) if is_package else [Path(file)]
        found = hashlib.blake2b(digest_size=8)
        with suppress(OSError):
            for one in files:
                found.update(hashlib.blake2b(one.read_bytes()).digest())
            yield name, found.hexdigest()


def _package(module: str) -> str:
    """The outermost package that a module is in, but for those that several distributions share;
    the module itself if there is none."""
    names = module.split(".")
    for count in range(1, len(names)):
        above = ".".join(names[:count])
        if getattr(sys.modules.get(above), "__file__", None) is not None:
            return above
    return module


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
