"""Part: what all replaceable parts of a scene have in common."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from typing import Any, ClassVar


class Part(ABC):  # noqa: B024 (each kind of part adds its own abstract methods)
    """A frozen attrs class whose fields are the keys that a scene gives to the part."""

    example: ClassVar[Mapping[str, Any]] = {}
    """Parameters of a typical part, as a scene would give them: `solidsph check` tests the part
    with these. Every parameter without a default needs a value here."""
