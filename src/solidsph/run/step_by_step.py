"""StepByStep: time loop for any combination of parts."""

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
    """Time loop that calls the integrator step by step, for any combination of parts."""

    dynamics: EquationOfMotion
    integrator: Integrator

    def advance(self, state: State, stop: int) -> State:
        while state.step < stop:
            try:
                # Overflow and invalid values are detected below.
                with np.errstate(all="ignore"):
                    after = self.integrator.advance(state, self.dynamics, self.dynamics.step_size)
                    # The sum is finite only if all entries are, and takes a fraction of a step.
                    finite = np.isfinite(after.accelerations.sum())
            except BuildError as cause:  # moving neighbours may no longer determine a gradient
                raise StepError(state, cause.problems[0]) from cause
            self._check_progress(state, after)
            state = after
            if not finite:
                raise StepError(state, NOT_FINITE)
        return state

    def _check_progress(self, state: State, after: State) -> None:
        steps = (after.time - state.time) / self.dynamics.step_size
        if after.step != state.step + 1 or not 0.999 < steps < 1.001:
            who = described(entry_of("integrators", self.integrator))
            raise PluginError(
                f"{who} made a step from step {state.step}, t = {state.time:.9g} s, to step "
                f"{after.step}, t = {after.time:.9g} s; a step must add 1 to the count and its "
                f"size, {self.dynamics.step_size:.9g} s, to the time"
            )


def steps_of(dynamics: Dynamics, integrator: Integrator) -> TimeLoop:
    """The engine's loop for these parts if it has one, else StepByStep."""
    loop = dynamics.internal.time_loop(dynamics, integrator)
    return StepByStep(dynamics, integrator) if loop is None else loop
