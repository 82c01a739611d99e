"""The user's cache: files that may be deleted at any time, and are then made anew."""

from __future__ import annotations

import hashlib
import os
import secrets
import threading
from contextlib import suppress
from pathlib import Path
from typing import final

import attrs

CACHE = "SOLIDSPH_CACHE"
"""Environment variable: folder of the cache, instead of the user's cache folder."""

_LOOKS = 100
"""How often the sum of all entries is looked at, on average, while the bound is written."""

_DIGEST = hashlib.sha256().digest_size  # bytes before the content of an entry


def cache_folder() -> Path:
    """Folder of the cache; it need not exist."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get(CACHE) or Path(home) / "solidsph")


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that no reader sees a part of it; do nothing where that is impossible."""
    draft = path.with_name(f"{path.name}.{os.getpid()}-{threading.get_ident()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_bytes(data)
        draft.replace(path)
    except OSError:
        with suppress(OSError):
            draft.unlink()


@final
@attrs.frozen
class Store:
    """A bounded folder of entries, which several processes may use at a time.

    An entry is written whole or not at all. A damaged one counts as missing. Beyond the bound, what
    was not used for longest is deleted.
    """

    name: str  # of its folder in the cache
    largest: int  # bound of the sum of all entries [bytes]

    @property
    def folder(self) -> Path:
        """Folder of the entries; it need not exist."""
        return cache_folder() / self.name

    @property
    def entries(self) -> list[tuple[Path, int]]:
        """Path and size [bytes] of every entry, that used last first."""
        found = []
        with suppress(OSError):
            for path in self.folder.iterdir():
                with suppress(OSError):  # another process may delete it
                    facts = path.stat()
                    found.append((facts.st_mtime, path, facts.st_size))
        return [(path, size) for _, path, size in sorted(found, reverse=True)]

    def read(self, key: str) -> bytes | None:
        """An entry; None if it is missing or damaged."""
        path = self.folder / key
        try:
            data = path.read_bytes()
            os.utime(path)
        except OSError:
            return None
        digest, content = data[:_DIGEST], data[_DIGEST:]
        return content if hashlib.sha256(content).digest() == digest else None

    def write(self, key: str, content: bytes) -> None:
        """Keep an entry; do nothing where that is impossible."""
        entry = hashlib.sha256(content).digest() + content
        write_whole(self.folder / key, entry)
        # To look at all entries after each write would take longer than to write. By chance, since
        # many processes write little each; the numbers of `random` are the user's.
        if secrets.randbelow(self.largest) < _LOOKS * len(entry):
            self._delete_beyond(self.largest)

    def clear(self) -> None:
        """Delete all entries."""
        self._delete_beyond(0)

    def _delete_beyond(self, bound: int) -> None:
        total = 0
        for path, size in self.entries:
            total += size
            if total > bound:
                with suppress(OSError):
                    path.unlink()


COMPILED = Store("compiled", 500_000_000)
"""Compiled functions."""

COMPILATIONS = Store("compilations", 1_000_000)
"""Notes of what is among them."""
