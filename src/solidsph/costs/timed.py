"""What a count cannot price is timed: parts of kinds that the cost model does not know."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial

import attrs
import numpy as np

from solidsph.costs.work import Loop, Work
from solidsph.interfaces.plan import SumMethod
from solidsph.simulation import Simulation

_COMPILED = (SumMethod.STENCILS, SumMethod.ROWS)

# Evaluations of which the quickest counts, after one that may have to find things first.
_REPEATS = 3


@attrs.frozen
class Timed:
    """Seconds of one evaluation, on the scene as it starts."""

    loads: Mapping[str, float] = attrs.field(factory=dict)  # by label, of those of no declared kind
    internal: float | None = None  # of forces whose law remembers, by arrays

    @property
    def seconds(self) -> float:
        """Of all that was timed [s]."""
        return sum(self.loads.values()) + (self.internal or 0.0)

    def without(self, label: str) -> Timed:
        """The same without one load."""
        return attrs.evolve(self, loads={k: v for k, v in self.loads.items() if k != label})

    def rest(self, work: Work, simulation: Simulation) -> Work:
        """The work that is left to be priced by its counts."""
        internal = tuple(simulation.dynamics.internal.operations)
        own = len(internal)
        kept = () if self.internal is not None else work.operations[:own]
        others = work.operations[own:]
        if self.loads:
            others = tuple(
                one for one in others if one.method is not SumMethod.UNKNOWN or not one.pairs
            )
        return attrs.evolve(work, operations=(*kept, *others))


def timed(simulation: Simulation, work: Work) -> Timed:
    """Time what the model does not know; nothing where steps are compiled or none are made."""
    if work.loop is not Loop.STEPS:
        return Timed()
    dynamics = simulation.dynamics
    # Not by the run's own start, whose forces may have to be compiled.
    x, v = simulation.initial.positions, simulation.initial.velocities
    u, step = x - dynamics.particles.positions, simulation.step_size
    loads = {
        load.label: _seconds(partial(load.advance, step, step, x, v, {}))
        for load in dynamics.loads
        if not load.is_counted
    }
    internal = dynamics.internal
    by_arrays = not any(part.method in _COMPILED for part in internal.operations)
    own = internal.advances_histories and by_arrays
    return Timed(
        loads,
        _seconds(partial(internal.advance, step, step, u, {})) if own else None,
    )


def _seconds(call: Callable[[], object]) -> float:
    best = float("inf")
    with np.errstate(all="ignore"):
        call()
        for _ in range(_REPEATS):
            begun = time.perf_counter()
            call()
            best = min(best, time.perf_counter() - begun)
    return best
