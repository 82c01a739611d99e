"""Predicted cost of each effect of a scene."""

from __future__ import annotations

from collections.abc import Mapping

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.count import count_work
from solidsph.costs.model import predict
from solidsph.costs.timing import Timings, time_uncounted
from solidsph.costs.work import Work
from solidsph.engines.law_forces import modified
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.terms import StressTerm
from solidsph.run.cfl_step import cfl_step
from solidsph.run.safe_step import safe_step
from solidsph.simulation import Simulation


@attrs.frozen
class Share:
    """Contribution of one effect to the cost of a run."""

    time: float  # fraction of the steps' time that the run saves without it, at equal step [-]
    step: float  # largest step with the effect over that without it [-]


def effect_shares(simulation: Simulation, machine: Calibration) -> Mapping[str, Share]:
    """Shares of all effects, by label, from predictions with and without each of them."""

    def steps(scene: Simulation, work: Work, timings: Timings) -> float:
        counted = timings.without_timed(work, scene)
        return predict(counted, machine, extra=timings.seconds).steps

    work = count_work(simulation)
    timings = time_uncounted(simulation, work)
    total = steps(simulation, work, timings)
    shares = {}
    for label in simulation.effects:
        reduced = without(simulation, label)
        reduced_work = count_work(reduced)
        modifies = isinstance(simulation.load_of(label), ForcesModifier)
        others = time_uncounted(reduced, reduced_work) if modifies else timings.without(label)
        rest = steps(reduced, reduced_work, others)
        shares[label] = Share(
            time=1.0 - rest / total if total > 0.0 else 0.0,
            step=_largest_step(simulation) / _largest_step(reduced),
        )
    return shares


def without(simulation: Simulation, label: str) -> Simulation:
    """A copy without the effect `label`, with the same step."""
    dynamics, bodies = simulation.dynamics, simulation.model.bodies
    loads = [load for load in dynamics.loads if load.label != label]
    internal = dynamics.internal
    if isinstance(simulation.load_of(label), ForcesModifier):
        stresses = [term for term in simulation.terms if isinstance(term, StressTerm)]
        internal = simulation.engine.prepare(bodies, stresses, simulation.steps)
        internal = modified(internal, bodies, loads, stresses)
    return attrs.evolve(
        simulation,
        effects={name: e for name, e in simulation.effects.items() if name != label},
        terms=[term for term in simulation.terms if term.label != label],
        dynamics=attrs.evolve(dynamics, loads=loads, internal=internal),
    )


def _largest_step(simulation: Simulation) -> float:
    """The largest step that a scene takes [s]."""
    dynamics, integrator = simulation.dynamics, simulation.integrator
    largest = cfl_step(integrator, dynamics.loads, simulation.model.bodies)
    if simulation.scene.statics is None:
        safe = safe_step(dynamics, integrator, simulation.initial)
        largest = largest if safe is None else min(largest, safe.step)
    return largest
