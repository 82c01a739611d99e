"""Advice: what a scene seems to call for and does not name, or names and does not need."""

from __future__ import annotations

import attrs


@attrs.frozen
class Advice:
    """One warning ahead of a run. Nothing follows from it: the run goes on as it is asked to."""

    found: str  # with the value, and where
    expected: str
    remedy: str
    name: str = ""  # by which a scene silences it

    @property
    def line(self) -> str:
        """As one line of text."""
        return f"{self.name}: {self.found}; expected: {self.expected}; {self.remedy}"
