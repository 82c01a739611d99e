"""Files that a scene names: wherever a table of it has a key `file`.

In a scene file their paths begin in the folder of that file, in a scene otherwise in the working
folder. What is read from a file therefore gets the way from one to the other.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from solidsph.system.files import located

FILE = "file"
"""The key whose value is the path of a file, in every table of a scene."""

_TAGS = "tags"


def read_in(table: Any, folder: Path) -> Any:
    """The table of a scene file in `folder`, with paths that begin in the working folder."""
    return _changed(table, lambda path: str(folder / path))  # an absolute one stays


def written_to(table: Any, folder: Path) -> Any:
    """The table of a scene with paths that begin in `folder`, in which its file will stand."""

    def change(path: str) -> str:
        return path if Path(path).is_absolute() else os.path.relpath(located(path), folder)

    return _changed(table, change)


def _changed(value: Any, change: Callable[[str], str]) -> Any:
    """The same tables and lists, with `change` of every path."""
    if isinstance(value, Mapping):
        changed = {}
        for key, entry in value.items():
            if key == FILE and isinstance(entry, str):
                changed[key] = change(entry)
            else:  # the keys of `tags` are names that the scene gives
                changed[key] = entry if key == _TAGS else _changed(entry, change)
        return changed
    return [_changed(entry, change) for entry in value] if isinstance(value, list) else value
