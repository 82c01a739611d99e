"""Energy of motions that the gradient does not see."""

from __future__ import annotations

from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.effect import Need
from solidsph.interfaces.terms import EnergyTerm, Observation
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.run.energy import strain_energy
from solidsph.watch.soundness import rounding
from solidsph.watch.symptom import Finding, Symptom


@final
@attrs.frozen
class HourglassEnergy(Symptom):
    """Hourglass control stores much energy beside the strain energy."""

    # The energy that terms store takes another pass over all pairs, by arrays: some ten steps.
    steps_between: ClassVar[int] = 1000

    warning: float = 0.2  # share of both energies [-]
    failure: float = 0.6  # [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        strain = strain_energy(observation)
        for term in simulation.terms:
            effect = simulation.effects.get(term.label)
            is_control = effect is not None and Need.UNSEEN_MOTIONS in (effect.answers or ())
            if not (is_control and isinstance(term, EnergyTerm)):
                continue
            energies = term.energies(observation)
            stored = float(energies.sum())
            # It does not matter where both energies are small beside the energy in play.
            share = stored / (stored + strain + 1e-3 * accounts.paid + rounding(simulation))
            finding = Finding.graded(
                share,
                self.warning,
                self.failure,
                particle=int(np.argmax(energies)),
                cause=f"{term.label} holds {share:.3g} of the elastic energy, most of it",
                remedy="a finer spacing, or a gradient that sees these motions such as 'quadratic'",
            )
            if finding is not None:
                return finding
        return None
