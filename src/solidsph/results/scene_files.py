"""Files that the bodies of a scene are read from, and digests of their contents."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from solidsph.scene.named_files import FILE as FILE_KEY
from solidsph.system.files import content

_MOST_BYTES = 2**32
_BYTES = 8

FILE = "file "
"""What the name of a file begins with among the versions of a record."""


def scene_files(scene: str) -> Iterator[str]:
    """Yield the paths that the bodies of a scene, as TOML, are read from; one may occur twice."""
    try:
        yield from _entries(tomllib.loads(scene).get("body", {}))
    except tomllib.TOMLDecodeError:  # a scene composed in Python has no such form
        return


def file_versions(scene: str, folder: Path) -> Mapping[str, str]:
    """Digest of every file that bodies are read from, under "file PATH".

    Relative paths begin in `folder`. A file that cannot be read is left out.
    """
    found = {}
    for name in scene_files(scene):
        with suppress(OSError):
            data = content(folder / name, _MOST_BYTES)
            found[f"{FILE}{name}"] = hashlib.blake2b(data, digest_size=_BYTES).hexdigest()
    return found


def _entries(value: Any) -> Iterator[str]:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, entry in items:
        if isinstance(entry, (dict, list)):
            yield from _entries(entry)
        elif key == FILE_KEY and isinstance(entry, str):
            yield entry
