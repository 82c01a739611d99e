"""Particles faster than sound."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import attrs
import numpy as np

from solidsph.interfaces.terms import Observation
from solidsph.run.accounts import Accounts
from solidsph.watch.symptom import Finding, Symptom, graded

if TYPE_CHECKING:
    from solidsph.run.built_scene import BuiltScene


@final
@attrs.frozen
class FasterThanSound(Symptom):
    """A particle moves against its body, on the mean, faster than waves do."""

    warning: float = 0.5  # of the confined wave speed [-]
    failure: float = 1.0  # [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        found, part = 0, 0.0
        for body in simulation.model.bodies:
            # The mean is no faster than the fastest.
            fastest = 2.0 * np.sqrt(observation.squared_speeds[body.extent].max())
            if fastest < self.warning * body.material.wave_speed:
                continue
            v, m = observation.state.velocities[body.extent], observation.masses[body.extent]
            with np.errstate(all="ignore"):  # what overflows is a finding
                against = v - (m @ v) / m.sum()
                squares = np.where(m > 0.0, np.sum(against**2, axis=1), 0.0)
            own = int(np.argmax(squares))  # the first that is no number, if there is one
            ratio = float(np.sqrt(squares[own])) / body.material.wave_speed
            if not ratio <= part:
                found, part = body.extent.start + own, ratio
        grade = graded(part, self.warning, self.failure)
        if grade is None:
            return None
        return Finding(
            grade,
            found,
            f"the velocity against the body is {part:.3g} of the wave speed",
            "a smaller step; where something strikes, artificial-viscosity; check the units of "
            "loads and motions",
        )
