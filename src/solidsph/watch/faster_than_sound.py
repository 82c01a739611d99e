"""Particles faster than sound."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.interfaces.terms import Observation
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.watch.symptom import Finding, Symptom


@final
@attrs.frozen
class FasterThanSound(Symptom):
    """A particle moves faster than waves, relative to the mean velocity of its body."""

    warning: float = 0.5  # of the confined wave speed [-]
    failure: float = 1.0  # [-]

    def look(
        self, simulation: BuiltScene, observation: Observation, accounts: Accounts
    ) -> Finding | None:
        particle, largest = 0, 0.0
        for body in simulation.model.bodies:
            # The mean is no faster than the fastest.
            fastest = 2.0 * np.sqrt(observation.squared_speeds[body.extent].max())
            if fastest < self.warning * body.material.wave_speed:
                continue
            v, m = observation.state.velocities[body.extent], observation.masses[body.extent]
            with np.errstate(all="ignore"):  # what overflows is a finding
                relative = v - (m @ v) / m.sum()
                squares = np.where(m > 0.0, np.sum(relative**2, axis=1), 0.0)
            worst = int(np.argmax(squares))  # the first NaN, if there is one
            ratio = float(np.sqrt(squares[worst])) / body.material.wave_speed
            if not ratio <= largest:
                particle, largest = body.extent.start + worst, ratio
        return Finding.graded(
            largest,
            self.warning,
            self.failure,
            particle=particle,
            cause=f"the velocity against the body is {largest:.3g} of the wave speed",
            remedy="a smaller step; where something strikes, artificial-viscosity; check the units "
            "of loads and motions",
        )
