"""TimeLoop: the steps between two outputs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from solidsph.errors import PortableError
from solidsph.model.particles import State

NOT_FINITE = "the acceleration is not finite"


class StepError(PortableError):
    """A step after which the run cannot continue; the caller of the loop reports it."""

    def __init__(self, state: State, cause: str) -> None:
        self.state = state
        self.cause = cause
        super().__init__(cause)


class TimeLoop(ABC):
    """Carries out the steps of one scene."""

    @property
    def effort(self) -> Mapping[str, Any]:
        """Statistics of the steps carried out, "quantity [unit]" -> number."""
        return {}

    @abstractmethod
    def advance(self, state: State, stop: int) -> State:
        """The state when `stop` steps have been made in all, those before `state` included.

        Raises:
            StepError: an acceleration is not finite, or the forces can no longer be formed.
        """
