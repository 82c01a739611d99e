"""What each effect of a scene is predicted to take: its share of the steps, and of the step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.counted import counted
from solidsph.costs.model import predicted
from solidsph.costs.timed import timed
from solidsph.engines.history import modified
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.terms import Load, StressTerm
from solidsph.run.stable_step import stable_step
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
    found = {}
    for label in simulation.effects:
        fewer = without(simulation, label)
        own = counted(fewer)
        modifies = isinstance(simulation.load_of(label), ForcesModifier)
        left = timed(fewer, own) if modifies else apart.without(label)
        rest = predicted(left.rest(own, fewer), machine, besides=left.seconds).steps
        found[label] = Share(
            time=1.0 - rest / whole if whole > 0.0 else 0.0,
            step=_stable_step(simulation) / _stable_step(fewer),
        )
    return found


def without(simulation: Simulation, label: str) -> Simulation:
    """The same, with the same step, without the effect of that label."""
    dynamics = simulation.dynamics
    effects = {name: one for name, one in simulation.effects.items() if name != label}
    loads = [one for one in dynamics.loads if one.label != label]
    internal = dynamics.internal
    if isinstance(simulation.load_of(label), ForcesModifier):
        internal = _internal(simulation, loads)
    return attrs.evolve(
        simulation,
        effects=effects,
        terms=[one for one in simulation.terms if one.label != label],
        dynamics=attrs.evolve(dynamics, loads=loads, internal=internal),
    )


def _stable_step(simulation: Simulation) -> float:
    dynamics = simulation.dynamics
    return stable_step(simulation.integrator, dynamics.loads, simulation.model.bodies)


def _internal(simulation: Simulation, loads: Sequence[Load]) -> InternalForces:
    """The internal forces as these loads modify them."""
    bodies = simulation.model.bodies
    stresses = [term for term in simulation.terms if isinstance(term, StressTerm)]
    internal = simulation.engine.prepare(bodies, stresses, simulation.steps)
    return modified(internal, bodies, loads, stresses)
