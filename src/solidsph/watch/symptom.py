"""Symptom: one sign that a run goes wrong."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

import attrs

from solidsph.interfaces.terms import Observation
from solidsph.run.accounts import Accounts

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene


class Grade(Enum):
    """How much a finding matters."""

    WARNING = "warning"  # the run may go on, its result is in doubt
    FAILURE = "failure"  # going on is of no use


@attrs.frozen
class Finding:
    """What was found at one output."""

    grade: Grade
    particle: int  # where it is worst
    cause: str  # with the number found
    remedy: str


class Symptom(ABC):
    """Looks at outputs for one sign; an implementation is a frozen set of limits."""

    steps_between: ClassVar[int] = 0
    """Steps between two looks at least, for a look that costs as much as some steps do; the last
    output is looked at always."""

    @abstractmethod
    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        """What there is to find at this output, the worst of it.

        Args:
            simulation: what runs.
            observation: the output.
            accounts: energies up to this output, it included.
        """


def graded(value: float, warning: float, failure: float) -> Grade | None:
    """The grade of a value that had better be small."""
    if not value < failure:  # no number is a failure
        return Grade.FAILURE
    return Grade.WARNING if value >= warning else None
