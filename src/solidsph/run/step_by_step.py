"""StepByStep: the time loop that fits all parts."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.errors import BuildError, PluginError
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.time_loop import NOT_FINITE, StepError, TimeLoop
from solidsph.model.particles import State
from solidsph.registry.origin import described
from solidsph.registry.registry import entry_of
from solidsph.run.dynamics import Dynamics


@final
@attrs.frozen(eq=False)
class StepByStep(TimeLoop):
    """One step after the other, as the parts themselves carry it out: it fits all of them."""

    dynamics: EquationOfMotion
    integrator: Integrator

    def advance(self, state: State, stop: int) -> State:
        while state.step < stop:
            try:
                # What overflows or is undefined shows as a value that is not finite, below.
                with np.errstate(all="ignore"):
                    after = self.integrator.advance(state, self.dynamics, self.dynamics.step_size)
            except BuildError as cause:  # a moving neighbourhood may stop determining a gradient
                raise StepError(state, cause.problems[0]) from cause
            self._check_progress(state, after)
            state = after
            # One sum tells whether any entry is not finite, at a fraction of a step's cost.
            if not np.isfinite(state.accelerations.sum()):
                raise StepError(state, NOT_FINITE)
        return state

    def _check_progress(self, state: State, after: State) -> None:
        gone = (after.time - state.time) / self.dynamics.step_size
        if after.step != state.step + 1 or not 0.999 < gone < 1.001:
            who = described(entry_of("integrators", self.integrator))
            raise PluginError(
                f"{who} made a step from step {state.step}, t = {state.time:.9g} s, to step "
                f"{after.step}, t = {after.time:.9g} s; a step adds 1 to the count and its size, "
                f"{self.dynamics.step_size:.9g} s, to the time"
            )


def steps_of(dynamics: Dynamics, integrator: Integrator) -> TimeLoop:
    """The engine's own loop for these parts, or one step after the other."""
    own = dynamics.internal.time_loop(dynamics, integrator)
    return StepByStep(dynamics, integrator) if own is None else own
