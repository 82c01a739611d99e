"""The compiler: `njit` as Numba's, with compiled functions kept on disk."""

from __future__ import annotations

import itertools
import secrets
from collections.abc import Callable
from typing import Any

import numba
from numba.core.bytecode import FunctionIdentity

from solidsph.engines.compiled.disk_cache import DiskCache

# Numba tells equally named functions apart by a number, counted from 1 in every process, and the
# linker takes functions of equal names for the same. Code of several processes meets in one, so
# each counts from a number of its own.
FunctionIdentity._unique_ids = itertools.count(secrets.randbits(62))


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """A compiled function, with the options of Numba's `njit`."""
    if function is None:
        return lambda function: njit(function, **options)
    compiled = numba.njit(**options)(function)
    compiled._cache = DiskCache(compiled)
    return compiled
