"""The line on the terminal that says what a build is doing, where it takes more than a second."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import final

from rich.text import Text

from solidsph.system.build_log import BUILD, is_last

_PAUSE = 1.0
"""A build that takes no longer shows no line [s]."""


@final
class BuildLine(logging.Handler):
    """The stage that a build is in, how far it is, and the time since the build began."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Time is that of the `clock` [s]."""
        super().__init__(logging.DEBUG)
        self._clock = clock
        self._stage = ""  # none
        self._part = ""
        self._begun = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        if is_last(record):
            self._stage = ""
            return
        if not self._stage:
            self._begun = self._clock()
        if record.levelno > logging.DEBUG:
            self._stage, self._part = record.getMessage(), ""
        elif self._stage:
            self._part = f", {record.getMessage()}"

    def text(self) -> Text:
        """The line; empty without a build, and in the first second of one."""
        seconds = self._clock() - self._begun
        if not self._stage or seconds < _PAUSE:
            return Text("")
        line = f"building, {seconds:.0f} s: {self._stage}{self._part}"
        return Text(line, no_wrap=True, overflow="ellipsis")

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Hear what builds tell in this block, however little of it is printed."""
        level = BUILD.level
        BUILD.addHandler(self)
        BUILD.setLevel(logging.DEBUG)
        try:
            yield
        finally:
            BUILD.removeHandler(self)
            BUILD.setLevel(level)
