"""Outcome: how a run ended, and what it leaves behind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from solidsph.model.particles import State

FINISHED, INTERRUPTED = "finished", "interrupted"
"""Outcomes of a run that got to its end, and of one that somebody stopped."""

UNSOUND = "unsound"
"""How the outcome begins of a run that got to its end with energies that do not add up."""


def is_over(outcome: str) -> bool:
    """Whether a run with this outcome got to its end, sound or not."""
    return outcome == FINISHED or outcome.startswith(UNSOUND)


@attrs.frozen(eq=False)
class Result:
    """What a run leaves behind."""

    state: State  # the last one
    record: Path | None  # the file written, if one was asked for
    seconds: float  # wall time of the run, compiling and recording included [s]
    effort: Mapping[str, Any]  # what it took besides: "quantity [unit]" -> a number, or yes or no
    final: Mapping[str, float] = attrs.field(factory=dict)  # the last row of a record's history
    notes: Sequence[str] = ()  # what happened to the run, as in the record
