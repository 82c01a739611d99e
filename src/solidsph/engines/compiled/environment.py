"""What compiled code depends on besides its functions: versions, settings, the engine's source."""

from __future__ import annotations

import hashlib
import os
import platform
from functools import cache
from importlib.metadata import version
from pathlib import Path

# Of Numba's settings, those that do not change the code.
_RUNTIME = frozenset(("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER"))


@cache
def environment() -> tuple[str, ...]:
    """Everything of it but the processor, which Numba knows."""
    own = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        own.update(path.read_bytes())
    settings = sorted(
        f"{name}={value}"
        for name, value in os.environ.items()
        if name.startswith("NUMBA_") and name not in _RUNTIME
    )
    versions = (platform.python_version(), *map(version, ("numba", "llvmlite", "numpy")))
    return (*versions, own.hexdigest(), *settings)
