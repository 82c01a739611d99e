"""Accounts: the energies of a run up to an output, and how much of them no account explains."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.errors import RecordError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.run.energy import residual, total_energy


@attrs.define
class Accounts:
    """What there is of energy; `add` enters one more output."""

    start: float = np.nan  # energy of the bodies at the first output [J]
    residual: float = 0.0  # at the last output: what no account explains [J]
    paid: float = 0.0  # the most so far of the start and the work of all accounts, by amount [J]

    def add(self, observation: Observation) -> None:
        """Enter one more output."""
        if np.isnan(self.start):
            self.start = total_energy(observation)
        self.residual = residual(observation, self.start)
        work = observation.state.work.values()
        self.paid = max(self.paid, self.start + sum(abs(one) for one in work))

    def kept(self) -> Array:
        """As one array."""
        return np.array(attrs.astuple(self))

    @classmethod
    def taken(cls, kept: Array) -> Accounts:
        """From such an array.

        Raises:
            RecordError: it is none.
        """
        if kept.shape != (len(attrs.fields(cls)),):
            raise RecordError(
                "the checkpoint does not hold the energies of its run; delete it and resume again: "
                "the run is then carried out from its first state"
            )
        return cls(*kept.tolist())
