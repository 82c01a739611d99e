"""What each effect of a scene is predicted to take: its share of the steps, and of the step."""

from __future__ import annotations

from collections.abc import Mapping

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.counted import counted
from solidsph.costs.model import predicted
from solidsph.costs.timed import timed
from solidsph.engines.history import remembering
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.terms import StressTerm
from solidsph.run.stable_step import step_by_rates
from solidsph.simulation import Simulation


@attrs.frozen
class Share:
    """One effect's part in the cost of a run."""

    time: float  # of the steps' time: what they would take less without it, at the same step [-]
    step: float  # the stable step with it, over that without it [-]


def shares(simulation: Simulation, machine: Calibration) -> Mapping[str, Share]:
    """Of every effect, by label: the scene is priced with it and without it."""
    work = counted(simulation)
    apart = timed(simulation, work)
    whole = predicted(apart.rest(work, simulation), machine, besides=apart.seconds).steps
    bodies, effects = simulation.model.bodies, simulation.effects
    rates = {n: (e.stiffness_rate(bodies), e.damping_rate(bodies)) for n, e in effects.items()}
    step = step_by_rates(simulation.integrator, rates.values(), bodies)
    found = {}
    for label in effects:
        others = [rate for name, rate in rates.items() if name != label]
        fewer = without(simulation, label)
        own = counted(fewer)
        left = timed(fewer, own) if _acts_within(effects[label]) else apart.without(label)
        rest = predicted(left.rest(own, fewer), machine, besides=left.seconds).steps
        found[label] = Share(
            time=1.0 - rest / whole if whole > 0.0 else 0.0,
            step=step / step_by_rates(simulation.integrator, others, bodies),
        )
    return found


def without(simulation: Simulation, label: str) -> Simulation:
    """The same, with the same step, without the effect of that label."""
    dynamics = simulation.dynamics
    effects = {name: one for name, one in simulation.effects.items() if name != label}
    loads = [one for one in dynamics.loads if one.label != label]
    internal = dynamics.internal
    if _acts_within(simulation.effects[label]):
        internal = _internal(simulation, effects)
    return attrs.evolve(
        simulation,
        effects=effects,
        terms=[one for one in simulation.terms if one.label != label],
        dynamics=attrs.evolve(dynamics, loads=loads, internal=internal),
    )


def _acts_within(effect: Effect) -> bool:
    """Whether it changes how bodies act on themselves."""
    return type(effect).within is not Effect.within


def _internal(simulation: Simulation, effects: Mapping[str, Effect]) -> InternalForces:
    """The internal forces as these effects let them act."""
    model = simulation.model
    stresses = [c for c in simulation.terms if isinstance(c, StressTerm)]
    internal = simulation.engine.prepare(model.bodies, stresses, simulation.steps)
    for effect in effects.values():
        internal = effect.within(internal, model, stresses)
    return remembering(internal, model.bodies, stresses)
