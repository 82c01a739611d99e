"""Motions that the gradient does not see."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.effect import Need
from solidsph.interfaces.terms import EnergyTerm, Observation
from solidsph.run.accounts import Accounts
from solidsph.run.energy import strain_energy
from solidsph.watch.soundness import rounding
from solidsph.watch.symptom import Finding, Symptom, graded

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene


@final
@attrs.frozen
class HourglassEnergy(Symptom):
    """What a control of unseen motions stores is much beside the strain energy."""

    # What conditions store is another pass over all pairs, by arrays: some ten steps or so.
    steps_between: ClassVar[int] = 1000

    warning: float = 0.2  # share of both [-]
    failure: float = 0.6  # [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        strain = strain_energy(observation)
        for condition in simulation.terms:
            effect = simulation.effects.get(condition.label)
            controls = effect is not None and Need.UNSEEN_MOTIONS in (effect.answers or ())
            if not (controls and isinstance(condition, EnergyTerm)):
                continue
            energies = condition.energies(observation)
            own = float(energies.sum())
            # Energies of both that are small beside all that there is are of no consequence.
            share = own / (own + strain + 1e-3 * accounts.paid + rounding(simulation))
            grade = graded(share, self.warning, self.failure)
            if grade is not None:
                return Finding(
                    grade,
                    int(np.argmax(energies)),
                    f"{condition.label} holds {share:.3g} of the elastic energy, most of it",
                    "a finer spacing, or a gradient that sees these motions such as 'quadratic'",
                )
        return None
