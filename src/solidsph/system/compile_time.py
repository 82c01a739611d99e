"""Time that this process has spent on compiling: the next one finds the code on disk."""

from __future__ import annotations

from typing import final

import attrs


@final
@attrs.define
class CompileTime:
    """A sum that the compiler adds to, once it is loaded."""

    seconds: float = 0.0  # wall time


COMPILE_TIME = CompileTime()
