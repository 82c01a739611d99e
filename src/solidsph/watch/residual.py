"""Energy that no account explains."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import attrs
import numpy as np

from solidsph.interfaces.condition import Observation
from solidsph.results.accounts import Accounts
from solidsph.soundness import rounding
from solidsph.watch.symptom import Finding, Symptom, graded

if TYPE_CHECKING:
    from solidsph.simulation import Simulation


@final
@attrs.frozen
class EnergyFromNowhere(Symptom):
    """The energy residual is beyond a part of the energy in play at two outputs in succession,
    and does not fall.

    In play is the energy at the start and the work of every account, by its amount. In the first
    steps of a load there is next to none, and the residual may be all of it; then it falls.
    """

    warning: float = 0.1  # [-]
    failure: float = 1.0  # [-]

    def look(
        self, simulation: Simulation, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        floor = rounding(simulation)
        part = abs(accounts.residual) / (accounts.paid + floor)
        before = abs(accounts.before) / (accounts.paid_before + floor)
        if part < before:
            return None
        grade = graded(min(part, before), self.warning, self.failure)  # of no number, that
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
