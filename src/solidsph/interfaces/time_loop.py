"""TimeLoop: how steps between two outputs are carried out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from solidsph.errors import PortableError
from solidsph.model.particles import State

NOT_FINITE = "the acceleration is not finite"


class StepError(PortableError):
    """A step that cannot be gone on from; for whoever runs the loop, who knows what to say."""

    def __init__(self, state: State, cause: str) -> None:
        self.state = state
        self.cause = cause
        super().__init__(cause)


class TimeLoop(ABC):
    """Steps of one scene."""

    @property
    def effort(self) -> Mapping[str, Any]:
        """What the loop has to tell of its steps: "quantity [unit]" -> a number."""
        return {}

    @abstractmethod
    def advance(self, state: State, stop: int) -> State:
        """The state after `stop` steps in all.

        Raises:
            StepError: an acceleration is not finite, or the forces cannot be formed any more.
        """
