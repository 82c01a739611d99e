"""Accounts: energies of a run from output to output, as far as watching needs them."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.interfaces.condition import Observation
from solidsph.results.energy import kinetic_energy, strain_energy


@attrs.define(eq=False)
class Accounts:
    """What there was of energy at each output so far."""

    energies: list[float] = attrs.field(factory=list)  # kinetic and strain [J]
    residuals: list[float] = attrs.field(factory=list)  # that no account explains [J]
    paid: list[float] = attrs.field(factory=list)  # at the start, and by or to accounts [J]

    def add(self, observation: Observation) -> None:
        """Enter one more output."""
        energy = kinetic_energy(observation) + strain_energy(observation)
        work = observation.state.work.values()
        self.energies.append(energy)
        self.residuals.append(energy - self.energies[0] - sum(work))
        self.paid.append(self.energies[0] + sum(abs(one) for one in work))

    def kept(self) -> Array:
        """As one array."""
        return np.array([self.energies, self.residuals, self.paid])

    @classmethod
    def taken(cls, kept: Array) -> Accounts:
        """From such an array."""
        return cls(*kept.tolist())
