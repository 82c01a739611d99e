"""Compiled functions on disk, so that the next process need not compile them again.

The key of an entry is the content of its function, the types of the arguments, the processor and
the versions involved. Numba's own cache knows a closure by the identity of what it holds, which
differs in every process: it misses wherever functions are composed.
"""

from __future__ import annotations

import logging
import pickle
from typing import Any, final

from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature

from solidsph.engines.compiled.content import UnknownContentError, content
from solidsph.engines.compiled.environment import environment
from solidsph.system.cache import COMPILED

LOG = logging.getLogger(__name__)


@final
class DiskCache:
    """What a compiled function asks before it compiles, in the place of Numba's own cache."""

    def __init__(self, function: Dispatcher) -> None:
        self._function = function

    @property
    def cache_path(self) -> str:
        """Folder of the entries, which Numba reports in statistics."""
        return str(COMPILED.folder)

    def load_overload(self, signature: Any, target_context: Any) -> CompileResult | None:
        """The function compiled for these arguments; None if it is not on disk."""
        key = self._key(signature, target_context.codegen())
        payload = None if key is None else COMPILED.read(key)
        if payload is None:
            LOG.debug("compiling %s", self._function.py_func.__name__)
            return None
        target_context.refresh()
        try:
            return CompileResult._rebuild(target_context, *pickle.loads(payload))
        except (ImportError, AttributeError):  # the module that it was compiled from is not here
            return None

    def save_overload(self, signature: Any, result: CompileResult) -> None:
        """Keep a function that has just been compiled."""
        # Code with addresses of this process in it makes no sense in another.
        if result.lifted or result.library.has_dynamic_globals:
            return
        key = self._key(signature, result.library.codegen)
        if key is not None:
            COMPILED.write(key, dumps(result._reduce()))

    def _key(self, signature: Any, codegen: Any) -> str | None:
        types = normalize_signature(signature), codegen.magic_tuple()
        try:
            return content(self._function, types, environment())
        except UnknownContentError:
            return None
