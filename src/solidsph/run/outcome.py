"""Outcome and result of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from solidsph.model.particles import State

FINISHED, INTERRUPTED = "finished", "interrupted"
"""Outcomes of a completed run, and of one interrupted by the user."""

UNSOUND = "unsound"
"""First word of the outcome of a completed run whose energies do not balance."""


def is_over(outcome: str) -> bool:
    """Whether a run with this outcome is complete, sound or not."""
    return outcome == FINISHED or outcome.startswith(UNSOUND)


@attrs.frozen(eq=False)
class Result:
    """Result of a run."""

    state: State  # the last one
    record: Path | None  # the file written, if any
    seconds: float  # wall time, compilation and record included [s]
    effort: Mapping[str, Any]  # further costs: "quantity [unit]" -> number or bool
    final: Mapping[str, float] = attrs.field(factory=dict)  # last row of the record's history
    notes: Sequence[str] = ()  # events of the run, as in the record
