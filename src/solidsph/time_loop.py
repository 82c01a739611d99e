"""TimeLoop: how steps between two outputs are carried out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, final

import attrs
import numpy as np

from solidsph.blame import described
from solidsph.dynamics import Dynamics
from solidsph.errors import BuildError, PluginError, PortableError
from solidsph.interfaces.integrator import Integrator
from solidsph.particles import State
from solidsph.registry import entry_of


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


@final
@attrs.frozen(eq=False)
class StepByStep(TimeLoop):
    """One step after the other, as the parts themselves carry it out: it fits all of them."""

    dynamics: Dynamics
    integrator: Integrator
    step_size: float  # [s]

    def advance(self, state: State, stop: int) -> State:
        while state.step < stop:
            try:
                # What overflows or is undefined shows as a value that is not finite, below.
                with np.errstate(all="ignore"):
                    after = self.integrator.advance(state, self.dynamics, self.step_size)
            except BuildError as cause:  # a moving neighbourhood may stop determining a gradient
                raise StepError(state, cause.problems[0]) from cause
            self._check_progress(state, after)
            state = after
            # One sum tells whether any entry is not finite, at a fraction of a step's cost.
            if not np.isfinite(state.accelerations.sum()):
                raise StepError(state, NOT_FINITE)
        return state

    def _check_progress(self, state: State, after: State) -> None:
        gone = (after.time - state.time) / self.step_size
        if after.step != state.step + 1 or not 0.999 < gone < 1.001:
            who = described(entry_of("integrators", self.integrator))
            raise PluginError(
                f"{who} made a step from step {state.step}, t = {state.time:.9g} s, to step "
                f"{after.step}, t = {after.time:.9g} s; a step adds 1 to the count and its size, "
                f"{self.step_size:.9g} s, to the time"
            )


NOT_FINITE = "the acceleration is not finite"
