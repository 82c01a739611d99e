"""What a command is asked to work on: a scene file, or a built-in case by name."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from solidsph import registry
from solidsph.errors import SceneError
from solidsph.interfaces.case import Case
from solidsph.parts import construct
from solidsph.scene import Scene


def resolve(target: str, settings: Sequence[str]) -> Scene | Case:
    """A scene from a path, or a case from its name with parameters `name=value`.

    Raises:
        SceneError: neither a file nor a case is called so, or a setting is wrong.
    """
    path = Path(target)
    if target.endswith(".toml") or path.exists():
        if settings:
            raise SceneError(
                f"--set changes the parameters of a case; {target!r} is a scene file: edit it"
            )
        return Scene.read(path)
    if target not in registry.names("cases") and ("/" in target or "." in target):
        raise SceneError(f"no file {target!r}; give a scene file, or a case: solidsph cases")
    case: Case = construct("cases", {"type": target, **parameters(settings)})
    return case


def parameters(settings: Sequence[str]) -> dict[str, Any]:
    """`name=value` pairs as a table; a value is read as TOML, or else as text."""
    table: dict[str, Any] = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals or not name.strip():
            raise SceneError(f"--set {setting!r} is not of the form name=value")
        try:
            parsed = tomllib.loads(f"value = {value}")
        except tomllib.TOMLDecodeError:
            parsed = {"value": value}
        table[name.strip()] = parsed["value"] if set(parsed) == {"value"} else value
    return table
