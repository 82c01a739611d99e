"""Timing of the parts that the cost model does not know."""

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

# The fastest of this many evaluations counts, after a first one that may fill caches.
_REPEATS = 3


@attrs.frozen
class Timings:
    """Times of one evaluation at the initial state."""

    loads: Mapping[str, float] = attrs.field(factory=dict)  # by label, if the model has no count
    internal: float | None = None  # internal forces of history materials on array engines [s]

    @property
    def seconds(self) -> float:
        """Total [s]."""
        return sum(self.loads.values()) + (self.internal or 0.0)

    def without(self, label: str) -> Timings:
        """Timings without the load `label`."""
        return attrs.evolve(self, loads={k: v for k, v in self.loads.items() if k != label})

    def without_timed(self, work: Work, simulation: Simulation) -> Work:
        """`work` without the operations that were timed."""
        count = len(simulation.dynamics.internal.operations)
        internal = () if self.internal is not None else work.operations[:count]
        others = work.operations[count:]
        if self.loads:
            others = tuple(
                part for part in others if part.method is not SumMethod.UNKNOWN or not part.pairs
            )
        return attrs.evolve(work, operations=(*internal, *others))


def time_uncounted(simulation: Simulation, work: Work) -> Timings:
    """Time the parts that the model does not know, unless there are no steps."""
    if work.loop is Loop.NEWTON:
        return Timings()
    dynamics = simulation.dynamics
    # `simulation.start()` could have to compile the forces first.
    x, v = simulation.initial.positions, simulation.initial.velocities
    u, step = x - dynamics.particles.positions, simulation.step_size
    loads = {
        load.label: _seconds(partial(load.advance, step, step, x, v, {}))
        for load in dynamics.loads
        if not load.is_counted
    }
    internal = dynamics.internal
    if internal.advances_histories and all(p.method not in _COMPILED for p in internal.operations):
        return Timings(loads, _seconds(partial(internal.advance, step, step, u, {})))
    return Timings(loads)


def _seconds(call: Callable[[], object]) -> float:
    best = float("inf")
    with np.errstate(all="ignore"):
        call()
        for _ in range(_REPEATS):
            start = time.perf_counter()
            call()
            best = min(best, time.perf_counter() - start)
    return best
