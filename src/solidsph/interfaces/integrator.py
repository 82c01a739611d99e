"""Integrator: how State advances over one time step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from solidsph.particles import State

if TYPE_CHECKING:
    from solidsph.dynamics import Dynamics


class Integrator(ABC):
    """An explicit scheme with one evaluation of the forces a step."""

    order: ClassVar[int]
    """Order of accuracy in the time step: halving it divides the error by 2^order."""

    stability_limit: ClassVar[float]
    """Largest stable product of the time step and the highest angular frequency [-]."""

    @abstractmethod
    def start(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        """The first state, with accelerations and whatever the scheme keeps in `memory`."""

    @abstractmethod
    def advance(self, state: State, dynamics: Dynamics, step_size: float) -> State:
        """The state one time step [s] later."""
