"""Accounts: the energies of a run up to an output, and how much of them no account explains."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.interfaces.condition import Observation
from solidsph.results.energy import residual, total_energy


@attrs.define
class Accounts:
    """What there is of energy; `add` enters one more output."""

    start: float = np.nan  # energy of the bodies at the first output [J]
    residual: float = 0.0  # at the last output: what no account explains [J]
    before: float = 0.0  # the same at the output before [J]
    paid: float = 0.0  # the most so far of the start and the work of all accounts, by amount [J]
    paid_before: float = 0.0  # the same at the output before [J]

    def add(self, observation: Observation) -> None:
        """Enter one more output."""
        if np.isnan(self.start):
            self.start = total_energy(observation)
        self.before, self.residual = self.residual, residual(observation, self.start)
        self.paid_before, self.paid = (
            self.paid,
            max(self.paid, self.start + sum(abs(one) for one in observation.state.work.values())),
        )

    def kept(self) -> Array:
        """As one array."""
        return np.array(attrs.astuple(self))

    @classmethod
    def taken(cls, kept: Array) -> Accounts:
        """From such an array."""
        return cls(*kept.tolist())
