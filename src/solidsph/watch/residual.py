"""Energy that no account explains."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import attrs
import numpy as np

from solidsph.interfaces.condition import Observation
from solidsph.watch.accounts import Accounts
from solidsph.watch.symptom import Finding, Symptom, graded

if TYPE_CHECKING:
    from solidsph.simulation import Simulation


@final
@attrs.frozen
class EnergyFromNowhere(Symptom):
    """The energy residual grows beyond a part of all the energy that was ever paid for.

    That is the energy at the start and the work of every account, by its amount. A residual that
    shrinks again is no symptom.
    """

    warning: float = 0.1  # [-]
    failure: float = 1.0  # [-]

    def look(
        self, simulation: Simulation, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        residual = abs(accounts.residual)
        if residual <= abs(accounts.before):
            return None
        part = residual / (accounts.paid + rounding(simulation))
        grade = graded(part, self.warning, self.failure)
        if grade is None:
            return None
        own = 0.5 * observation.masses * observation.squared_speeds
        own += observation.particles.volumes * observation.energy_densities
        own[observation.particles.ghosts] = 0.0
        return Finding(
            grade,
            int(np.argmax(own)),
            f"the energy residual grows, to {part:.3g} of all energy paid for, most of it",
            "half the time step; if the residual stays, the variational divergence, whose forces "
            "have an energy, or the total Lagrangian form",
        )


def rounding(simulation: Simulation) -> float:
    """An energy below which everything is rounding [J]: strains of about 1e-12."""
    return 1e-24 * sum(
        float(body.masses.sum()) * body.material.wave_speed**2 for body in simulation.setting.bodies
    )
