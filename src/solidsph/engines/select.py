"""Choice of an engine by name or by size."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping

from solidsph.engines.engine import Engine
from solidsph.engines.matrix import MatrixEngine
from solidsph.errors import SceneError

_ENGINES: Mapping[str, Callable[[], Engine]] = {
    "auto": MatrixEngine,  # the only one there is
    "matrix": MatrixEngine,
}


def engine_named(name: str) -> Engine:
    """The engine of that name.

    Raises:
        SceneError: there is none.
    """
    if name not in _ENGINES:
        near = difflib.get_close_matches(name, _ENGINES, 1)
        hint = f"did you mean {near[0]!r}?" if near else "take 'auto'"
        raise SceneError(f"unknown engine {name!r}; {hint} (known: {', '.join(_ENGINES)})")
    return _ENGINES[name]()
