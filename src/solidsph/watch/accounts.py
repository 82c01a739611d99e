"""Accounts: energies of a run up to an output, as far as watching needs them."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.interfaces.condition import Observation
from solidsph.results.energy import kinetic_energy, strain_energy


@attrs.define
class Accounts:
    """What there is of energy; `add` enters one more output."""

    start: float = np.nan  # kinetic and strain energy at the first output [J]
    residual: float = 0.0  # at the last output: what no account explains [J]
    before: float = 0.0  # the same at the output before [J]
    paid: float = 0.0  # the most so far of the start and the work of all accounts, by amount [J]

    def add(self, observation: Observation) -> None:
        """Enter one more output."""
        energy = kinetic_energy(observation) + strain_energy(observation)
        work = observation.state.work.values()
        if np.isnan(self.start):
            self.start = energy
        self.before, self.residual = self.residual, energy - self.start - sum(work)
        self.paid = max(self.paid, self.start + sum(abs(one) for one in work))

    def kept(self) -> Array:
        """As one array."""
        return np.array(attrs.astuple(self))

    @classmethod
    def taken(cls, kept: Array) -> Accounts:
        """From such an array."""
        return cls(*kept.tolist())
