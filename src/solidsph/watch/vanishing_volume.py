"""Volume that vanishes."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.interfaces.terms import Observation
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.watch.symptom import Finding, Grade, Symptom


@final
@attrs.frozen
class VanishingVolume(Symptom):
    """The volume ratio J of a particle is near zero, negative or NaN."""

    warning: float = 0.2  # J below which there is a warning [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        if observation.volume_ratios.min() >= self.warning:  # False if one is NaN
            return None
        J = np.where(observation.particles.ghosts, 1.0, observation.volume_ratios)
        worst = int(np.argmin(np.where(np.isfinite(J), J, -np.inf)))
        if J[worst] >= self.warning:
            return None
        return Finding(
            Grade.WARNING if J[worst] > 0.0 else Grade.FAILURE,
            worst,
            f"the volume vanishes, J = {J[worst]:.3g}",
            "a smaller step, a smoother or smaller load, artificial-viscosity where something "
            "strikes, or a finer spacing where the body is crushed",
        )
