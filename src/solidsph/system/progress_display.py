"""Displays of progress that are replaced in place: in the cell of a notebook, and on a terminal."""

from __future__ import annotations

import sys
import time as clock
from abc import ABC, abstractmethod
from html import escape
from importlib import import_module
from math import inf
from typing import Any, final

# Between two changes of a display [s]: a notebook stores none, and its page need not draw more.
_PAUSE = 0.1


class ProgressDisplay(ABC):
    """One line that says how far something is."""

    @abstractmethod
    def show(self, part: float, note: str = "") -> None:
        """Show that this part of it is done, from 0 to 1."""

    @abstractmethod
    def close(self, part: float, note: str) -> None:
        """Show for the last time, now with the outcome."""


@final
class NotebookDisplay(ProgressDisplay):
    """A bar below the cell that runs."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._handle: Any = None
        self._shown = -inf

    def show(self, part: float, note: str = "") -> None:
        now = clock.monotonic()
        if now - self._shown >= _PAUSE:
            self._shown = now
            self._put(part, note)

    def close(self, part: float, note: str) -> None:
        self._put(part, note)

    def _put(self, part: float, note: str) -> None:
        words = f"{self._title}: {100.0 * part:.0f} %{note and f', {note}'}"
        bar = f'<progress max="1" value="{part:.3f}"></progress>'
        data = {"text/plain": words, "text/html": f"<div>{bar} {escape(words)}</div>"}
        if self._handle is None:
            display = import_module("IPython.display").display
            self._handle = display(data, raw=True, display_id=True)
        else:
            self._handle.update(data, raw=True)


@final
class TerminalDisplay(ProgressDisplay):
    """A bar on the standard error, which is removed at the end; nothing if that is no terminal."""

    def __init__(self, title: str) -> None:
        console = import_module("rich.console").Console(stderr=True)
        self._bars: Any = None
        if console.is_terminal:
            self._bars = import_module("rich.progress").Progress(console=console, transient=True)
            self._task = self._bars.add_task(import_module("rich.markup").escape(title), total=1.0)

    def show(self, part: float, note: str = "") -> None:
        if self._bars is not None:
            self._bars.start()
            self._bars.update(self._task, completed=part)

    def close(self, part: float, note: str) -> None:
        if self._bars is not None:
            self._bars.stop()


def in_notebook() -> bool:
    """Whether this process computes for a notebook."""
    ipython: Any = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None


def progress_display(title: str, wanted: bool | None = None) -> ProgressDisplay | None:
    """The display that suits this process; None if there is to be none.

    Args:
        title: what is in progress.
        wanted: whether it is; by default in notebooks only.
    """
    notebook = in_notebook()
    if not (notebook if wanted is None else wanted):
        return None
    return NotebookDisplay(title) if notebook else TerminalDisplay(title)


def time_left(seconds: float | None) -> str:
    """Estimated remaining time in words."""
    if seconds is None:
        return "time left not known yet"
    if seconds < 90.0:
        return f"about {seconds:.0f} s left"
    if seconds < 5400.0:
        return f"about {seconds / 60.0:.0f} min left"
    return f"about {seconds / 3600.0:.1f} h left"
