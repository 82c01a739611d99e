"""Task: one run of one configuration of a case, with a key that is the same in every process."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from types import BuiltinFunctionType, FunctionType
from typing import Any, final

import attrs
import numpy as np

from solidsph.errors import SceneError, SolidsphError
from solidsph.registry import registry
from solidsph.results.scene_files import file_versions
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case
from solidsph.studies.variant import with_settings
from solidsph.system.files import working_folder


@final
@attrs.frozen
class Task:
    """One repeat of a run of a case with these settings."""

    case: Case
    settings: Mapping[str, Any] = attrs.field(factory=dict)  # as `with_settings` takes them
    repeat: int = 0

    @cached_property
    def configuration(self) -> str:
        """Hash of all that decides the outcome.

        It covers the case with its parameters, the settings, the resulting scenes, what is in the
        files that their bodies are read from, and the versions of solidsph and of every
        distribution that provides a part. A change of code without a change of version is noticed
        only if it changes the scenes.

        Raises:
            SceneError: a value in the case or the settings has no lasting description.
        """
        described = {"case": plain(self.case), "settings": plain(self.settings)}
        with suppress(SolidsphError):  # refused settings, or scenes with functions
            scenes = with_settings(self.case, self.settings).scenes()
            described["scenes"] = plain(scenes)
            if files := {k: v for scene in scenes.values() for k, v in _files(scene).items()}:
                described["files"] = files
        described["versions"] = _versions(set(_texts(described)))
        return hashlib.sha256(json.dumps(described, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def key(self) -> str:
        """Identifier in journals and between processes."""
        return f"{self.configuration}-{self.repeat}"


def plain(value: Any) -> Any:
    """`value` as data of JSON, the same in every process.

    Raises:
        SceneError: it contains an object whose identity is known to this process only.
    """
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return repr(float(value))  # exact, and for infinity too
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (type, FunctionType, BuiltinFunctionType)) and "<" not in _path(value):
        return _path(value)
    if attrs.has(type(value)):
        fields = attrs.fields(type(value))
        return {
            "": _path(type(value)),
            **{field.name: plain(getattr(value, field.name)) for field in fields},
        }
    raise SceneError(
        f"a sweep cannot name {value!r} in its journal; state it as a number, a text, a registered "
        "part, or a function of a module"
    )


def _files(scene: Scene) -> Mapping[str, str]:
    """Digests of the files of a scene; none of one that cannot be written."""
    try:
        return file_versions(scene.to_toml(), working_folder())
    except SceneError:
        return {}


def _path(named: Any) -> str:
    return f"{named.__module__}:{named.__qualname__}"


def _texts(described: Any) -> Iterator[str]:
    if isinstance(described, str):
        yield described
    elif isinstance(described, (Mapping, Sequence)):
        items = described.values() if isinstance(described, Mapping) else described
        for item in items:
            yield from _texts(item)


def _versions(texts: set[str]) -> dict[str, str]:
    """Versions of solidsph and of the distributions of parts whose name or class is in `texts`."""
    used = {
        entry.distribution: entry.version
        for entry in _installed(os.environ.get(registry.RESTRICT))
        if entry.distribution and (entry.name in texts or entry.target in texts)
    }
    return {**used, "solidsph": version("solidsph")}


@cache
def _installed(restriction: str | None) -> Sequence[registry.Entry]:
    """Installed parts, read once per process and restriction."""
    return [entry for kind in registry.INTERFACES for entry in registry.available(kind)]
