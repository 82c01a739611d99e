"""Named parts, found through entry points and loaded only when asked for.

Built-in parts have no privilege: they are listed, loaded and checked like anyone's.
"""

from __future__ import annotations

import difflib
import os
import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module, metadata
from importlib.metadata import Distribution, EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import attrs

from solidsph.errors import PluginError, SceneError

PREFIX = "solidsph."

# Kind of part -> (module, name) of its interface. Named and not imported, so that listing installed
# parts imports nothing.
INTERFACES: Mapping[str, tuple[str, str]] = {
    "kernels": ("solidsph.interfaces.kernel", "Kernel"),
    "shapes": ("solidsph.interfaces.shape", "Shape"),
    "discretisations": ("solidsph.interfaces.discretisation", "Discretisation"),
    "boundaries": ("solidsph.interfaces.boundary", "BoundaryHandler"),
    "materials": ("solidsph.interfaces.material", "Material"),
    "gradients": ("solidsph.interfaces.gradient", "Gradient"),
    "divergences": ("solidsph.interfaces.divergence", "Divergence"),
    "formulations": ("solidsph.interfaces.formulation", "Formulation"),
    "integrators": ("solidsph.interfaces.integrator", "Integrator"),
    "engines": ("solidsph.interfaces.engine", "Engine"),
    "effects": ("solidsph.interfaces.effect", "Effect"),
    "cases": ("solidsph.studies.case", "Case"),
}

HOOKS = "hooks"

RESTRICT = "SOLIDSPH_PLUGINS"
"""Environment variable: if set, only the distributions it lists (comma separated) are used."""


@attrs.frozen(order=True)
class Entry:
    """One installed part."""

    kind: str  # "kernels", "materials", ...
    name: str
    distribution: str
    version: str
    target: str  # "module:attribute"


def singular(kind: str) -> str:
    """The word for one part of a kind, as messages and scene files use it."""
    return {"boundaries": "boundary", "bodies": "body"}.get(kind, kind.removesuffix("s"))


def available(kind: str) -> tuple[Entry, ...]:
    """All installed parts of a kind, sorted by name; imports none of them."""
    return _entries(*_key(kind))


def names(kind: str) -> tuple[str, ...]:
    """Names of the installed parts of a kind, each once."""
    return tuple(sorted({entry.name for entry in available(kind)}))


def find(kind: str, name: str) -> Entry:
    """The part of that kind and name.

    Raises:
        SceneError: there is none; the message suggests the nearest match.
        PluginError: two distributions claim the name.
    """
    claims = sorted({entry for entry in available(kind) if entry.name == name})
    if not claims:
        known = names(kind)
        near = difflib.get_close_matches(name, known, 1)
        install = f"install the plugin that provides it (installed: {', '.join(known) or 'none'})"
        hint = f"did you mean {near[0]!r}?" if near else install
        raise SceneError(f"unknown {singular(kind)} {name!r}; {hint}")
    if len({claim.target for claim in claims}) > 1:
        rivals = " and ".join(f"{c.distribution} {c.version} ({c.target})" for c in claims)
        raise PluginError(
            f"{singular(kind)} {name!r} is claimed by {rivals}; uninstall one of them, or list the "
            f"distributions to use in {RESTRICT}"
        )
    return claims[0]


def load(kind: str, name: str) -> type[Any]:
    """Import the class of the part of that kind and name.

    Raises:
        SceneError: there is no such part.
        PluginError: it cannot be imported, or does not implement its interface.
    """
    entry = find(kind, name)
    where = f"{singular(kind)} {name!r} ({entry.target}, from {entry.distribution} {entry.version})"
    module, _, attribute = entry.target.partition(":")
    try:
        loaded: Any = import_module(module)
        for part in attribute.split("."):
            loaded = getattr(loaded, part)
    except Exception as cause:
        raise PluginError(
            f"{where} cannot be loaded: {type(cause).__name__}: {cause}; repair or uninstall "
            f"{entry.distribution}, or reinstall it if its entry points have changed"
        ) from cause
    expected = interface(kind)
    if not (isinstance(loaded, type) and issubclass(loaded, expected)):
        raise PluginError(
            f"{where} is not a {expected.__module__}.{expected.__qualname__}; derive it from that "
            "interface"
        )
    missing = sorted(getattr(loaded, "__abstractmethods__", ()))
    if missing:
        raise PluginError(f"{where} does not implement {', '.join(missing)}; define them")
    return loaded


def interface(kind: str) -> type[Any]:
    """The abstract class that parts of a kind implement."""
    module, name = INTERFACES[kind]
    found: type[Any] = getattr(import_module(module), name)
    return found


def entry_of(kind: str, part: object) -> Entry:
    """The registry's entry for an object, or a nameless one with its class as target."""
    cls = type(part)
    target = f"{cls.__module__}:{cls.__qualname__}"
    for entry in available(kind):
        if entry.target == target:
            return entry
    return Entry(kind=kind, name="", distribution="", version="", target=target)


def hook_points() -> tuple[EntryPoint, ...]:
    """Entry points of pluggy plugins."""
    return _points(HOOKS)


def _points(kind: str) -> tuple[EntryPoint, ...]:
    return _scanned(*_key(kind))


def _key(kind: str) -> tuple[Any, ...]:
    """Key of a scan for parts, which is cached: it takes milliseconds, and a scene needs many."""
    return entry_points, kind, os.environ.get(RESTRICT), _places()


def _places() -> tuple[tuple[str, int], ...]:
    """Where distributions may be, and when that changed."""
    return tuple((place, _modified(place)) for place in sys.path)


def _modified(place: str) -> int:
    try:
        return Path(place).stat().st_mtime_ns
    except OSError:
        return 0


def entry_points(*, group: str) -> EntryPoints:
    """Installed entry points of a group; those of all groups are read at once."""
    found: EntryPoints = _installed(_places()).select(group=group)
    return found


@lru_cache(maxsize=4)
def _installed(places: object) -> Any:  # before Python 3.12 of another type
    return metadata.entry_points()


@lru_cache(maxsize=64)
def _scanned(
    scan: Callable[..., Any], kind: str, allowed: str | None, places: object
) -> tuple[EntryPoint, ...]:
    points = scan(group=PREFIX + kind)
    if allowed is None:
        return tuple(points)
    chosen = {name.strip().lower() for name in allowed.split(",")}
    return tuple(p for p in points if p.dist is not None and p.dist.name.lower() in chosen)


@lru_cache(maxsize=64)
def _entries(*key: Any) -> tuple[Entry, ...]:
    return tuple(sorted(_entry(key[1], point) for point in _scanned(*key)))


def _entry(kind: str, point: EntryPoint) -> Entry:
    distribution, version = ("", "") if point.dist is None else _named(point.dist)
    return Entry(
        kind=kind,
        name=point.name,
        distribution=distribution,
        version=version,
        target=point.value,
    )


@lru_cache(maxsize=32)
def _named(distribution: Distribution) -> tuple[str, str]:
    """Name and version, cached since the whole metadata file, README included, is parsed."""
    metadata = distribution.metadata
    return metadata["Name"], metadata["Version"]
