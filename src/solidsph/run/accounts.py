"""Accounts: energy balance of a run up to an output."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.errors import RecordError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.run.energy import residual, total_energy


@attrs.define
class Accounts:
    """Energy balance; `add` updates it at every output."""

    start: float = np.nan  # energy of the bodies at the first output [J]
    residual: float = 0.0  # energy that no account explains at the last output [J]
    paid: float = 0.0  # largest sum so far of `start` and the absolute work of all accounts [J]

    def add(self, observation: Observation) -> None:
        """Update the balance with one more output."""
        if np.isnan(self.start):
            self.start = total_energy(observation)
        self.residual = residual(observation, self.start)
        work = observation.state.work.values()
        self.paid = max(self.paid, self.start + sum(abs(value) for value in work))

    def to_array(self) -> Array:
        """All values as one array."""
        return np.array(attrs.astuple(self))

    @classmethod
    def from_array(cls, values: Array) -> Accounts:
        """Read the array of `to_array`.

        Raises:
            RecordError: the array has another shape.
        """
        if values.shape != (len(attrs.fields(cls)),):
            raise RecordError(
                "the checkpoint does not hold the energies of its run; delete it and resume again: "
                "the run then starts from its initial state"
            )
        return cls(*values.tolist())
