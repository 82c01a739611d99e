"""Libraries of geometry, which are loaded only for shapes that need them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from solidsph.errors import SceneError

_NAMES = {"igl": "libigl"}


def geometry_library(module: str, extra: str = "geometry") -> Any:
    """A module that the named extra brings.

    Raises:
        SceneError: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as cause:
        raise SceneError(
            f"{_NAMES.get(module, module)} is not installed ({cause}); run: "
            f"pip install 'solidsph[{extra}]'"
        ) from None
