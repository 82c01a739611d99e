"""What each effect of a scene is predicted to take: its share of the steps, and of the step."""

from __future__ import annotations

from collections.abc import Mapping

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.counted import counted
from solidsph.costs.model import predicted
from solidsph.simulation import Simulation
from solidsph.step_size import step_by_rates


@attrs.frozen
class Share:
    """One effect's part in the cost of a run."""

    time: float  # of the steps' time: what they would take less without it, at the same step [-]
    step: float  # the stable step with it, over that without it [-]


def shares(simulation: Simulation, machine: Calibration) -> Mapping[str, Share]:
    """Of every effect, by label: the scene is priced with it and without it."""
    whole = predicted(counted(simulation), machine).steps
    bodies, effects = simulation.setting.bodies, simulation.effects
    rates = {n: (e.stiffness_rate(bodies), e.damping_rate(bodies)) for n, e in effects.items()}
    step = step_by_rates(simulation.integrator, rates.values(), bodies)
    found = {}
    for label in effects:
        others = [rate for name, rate in rates.items() if name != label]
        rest = predicted(counted(without(simulation, label)), machine).steps
        found[label] = Share(
            time=1.0 - rest / whole if whole > 0.0 else 0.0,
            step=step / step_by_rates(simulation.integrator, others, bodies),
        )
    return found


def without(simulation: Simulation, label: str) -> Simulation:
    """The same, with the same step, without the effect of that label."""
    dynamics = simulation.dynamics
    return attrs.evolve(
        simulation,
        effects={name: one for name, one in simulation.effects.items() if name != label},
        conditions=[one for one in simulation.conditions if one.label != label],
        dynamics=attrs.evolve(
            dynamics, loads=[one for one in dynamics.loads if one.label != label]
        ),
    )
