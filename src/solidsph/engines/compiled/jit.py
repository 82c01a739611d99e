"""The compiler: `njit` as Numba's, with compiled functions kept on disk."""

from __future__ import annotations

import itertools
import secrets
import time as clock
from collections.abc import Callable
from typing import Any, final

import numba
from numba.core.bytecode import FunctionIdentity
from numba.core.event import Event, Listener, register

from solidsph.engines.compiled.disk_cache import DiskCache
from solidsph.system.compile_time import COMPILE_TIME

# Numba tells equally named functions apart by a number, counted from 1 in every process, and the
# linker takes functions of equal names for the same. Code of several processes meets in one, so
# each counts from a number of its own.
FunctionIdentity._unique_ids = itertools.count(secrets.randbits(62))


@final
class _CompileClock(Listener):
    """Counts the time of compilations, of which one may begin within another."""

    def __init__(self) -> None:
        self._depth = 0

    def on_start(self, event: Event) -> None:
        if self._depth == 0:
            self._begun = clock.perf_counter()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        self._depth -= 1
        if self._depth == 0:
            COMPILE_TIME.seconds += clock.perf_counter() - self._begun


register("numba:compile", _CompileClock())

# What Python needs in order to call a function takes a quarter of the time of its compilation.
_WITHOUT_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """A compiled function, with the options of Numba's `njit`.

    Compiled functions that call it get a version that Python cannot call, and Python another.
    """
    if function is None:
        return lambda function: njit(function, **options)
    from_python = _kept_on_disk(numba.njit(**options)(function))
    from_compiled = _kept_on_disk(numba.njit(**options, **_WITHOUT_WRAPPERS)(function))
    from_python.get_call_template = from_compiled.get_call_template
    from_python.get_overload = from_compiled.get_overload
    return from_python


def _kept_on_disk(function: Any) -> Any:
    function._cache = DiskCache(function)
    return function
