"""One warning ahead of a run: something that a scene seems to lack, or names without need."""

from __future__ import annotations

import attrs


@attrs.frozen
class Advice:
    """One warning ahead of a run. It changes nothing: the run goes on as it was asked for."""

    finding: str  # with the value, and where
    expected: str
    remedy: str
    name: str = ""  # by which a scene silences it

    @property
    def line(self) -> str:
        """All of it in one line of text."""
        return f"{self.name}: {self.finding}; expected: {self.expected}; {self.remedy}"
