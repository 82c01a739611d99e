"""Symptom: one sign that a run goes wrong."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum
from typing import ClassVar

import attrs

from solidsph.interfaces.terms import Observation
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene


class Grade(Enum):
    """Severity of a finding."""

    WARNING = "warning"  # the run may go on, its result is in doubt
    FAILURE = "failure"  # going on is of no use


@attrs.frozen
class Finding:
    """A symptom at one output."""

    grade: Grade
    particle: int  # where it is worst
    cause: str  # with the value
    remedy: str

    @classmethod
    def graded(
        cls, value: float, warning: float, failure: float, *, particle: int, cause: str, remedy: str
    ) -> Finding | None:
        """A failure or a warning where a value is too large, or NaN; None where it is small."""
        if not value < failure:
            return cls(Grade.FAILURE, particle, cause, remedy)
        return cls(Grade.WARNING, particle, cause, remedy) if value >= warning else None


class Symptom(ABC):
    """Looks for one sign in outputs; an implementation is a frozen set of limits."""

    steps_between: ClassVar[int] = 0
    """Least number of steps between two looks, for a look that costs as much as several steps.
    The last output is always looked at."""

    @abstractmethod
    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        """The worst finding at this output, which `accounts` include."""
