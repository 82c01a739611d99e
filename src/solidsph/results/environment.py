"""Environment of a run: what, besides the scene, its last digits depend on."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path

from solidsph.registry import registry
from solidsph.results.layout import PluginUsed
from solidsph.run.built_scene import BuiltScene

_SOFTWARE = ("solidsph", "numpy", "scipy", "numba")
_CODE = "code of "


def run_environment(simulation: BuiltScene) -> Mapping[str, str]:
    """Versions of software, version and code of every part used, and the number of threads."""
    used = [PluginUsed.of(entry) for entry in simulation.parts]
    return {
        **{name: metadata.version(name) for name in _SOFTWARE},
        "python": platform.python_version(),
        "machine": platform.machine(),
        "threads": _threads(),
        **part_versions(used),
        **{f"{_CODE}{name}": digest for name, digest in _code_digests(used)},
    }


def is_part(name: str) -> bool:
    """True if an entry is about a part, which not every run uses."""
    return " " in name and not name.startswith(_CODE)


def _code_digests(used: Sequence[PluginUsed]) -> Iterator[tuple[str, str]]:
    """Digest of the code of every package that a part is in, or of a module that is in none.

    A version may not show a change of code, and a part may call code of another module.
    """
    for name in dict.fromkeys(_package(part.target.partition(":")[0]) for part in used):
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is None:
            continue
        is_package = hasattr(sys.modules[name], "__path__")
        files = sorted(Path(file).parent.rglob("*.py")) if is_package else [Path(file)]
        digest = hashlib.blake2b(digest_size=8)
        with suppress(OSError):
            for path in files:
                digest.update(hashlib.blake2b(path.read_bytes()).digest())
            yield name, digest.hexdigest()


def _package(module: str) -> str:
    """The outermost package of a module, but for namespaces; the module if it is in none."""
    names = module.split(".")
    for count in range(1, len(names)):
        package = ".".join(names[:count])
        if getattr(sys.modules.get(package), "__file__", None) is not None:
            return package
    return module


def part_versions(used: Sequence[PluginUsed]) -> Mapping[str, str]:
    """ "kind name" of every part -> its distribution and version."""
    return {
        f"{registry.singular(part.group)} {part.name or part.target}": (
            f"{part.distribution or 'no distribution'} {part.version}".rstrip()
        )
        for part in used
    }


def _threads() -> str:
    """Number of threads: sums are divided among them, here and in libraries for vectors."""
    wanted = os.environ.get("NUMBA_NUM_THREADS")
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{count}" if wanted is None else f"{count}, {wanted} of them compiled"


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> Sequence[str]:
    """Changes between two environments, in words."""
    return [
        f"{name} was {then.get(name, 'not there')}, is {now.get(name, 'not there')}"
        for name in dict.fromkeys((*then, *now))
        if then.get(name) != now.get(name)
    ]
