"""Energies and momenta of a record, as the hard cases ask for them."""

from __future__ import annotations

import numpy as np

from solidsph.arrays import Array
from solidsph.interfaces.case import Measurement
from solidsph.results.record import Record
from solidsph_builtin.cases._compare import FINISHED


def total_energy(record: Record) -> Array:
    """Kinetic, strain and, where there is one, the hourglass control's, (t,) [J]."""
    total: Array = np.sum(
        [
            values
            for name, values in record.history.items()
            if name.endswith("energy [J]") and not name.startswith("energy residual")
        ],
        axis=0,
    )
    return total


def energy_kept(record: Record, tolerance: float) -> Measurement:
    """Largest change of the energy of a body on which nothing acts, over its start."""
    energy = total_energy(record)
    change = float(np.abs(energy / energy[0] - 1.0).max())
    return Measurement(
        quantity="largest relative change of energy",
        value=change,
        unit="1",
        reference=0.0,
        source="nothing acts on the body",
        error=change,
        passed=record.outcome == FINISHED and change <= tolerance,
    )


def smallest_volume_ratio(record: Record) -> Measurement:
    """Smallest J of any particle at any time."""
    smallest = float(np.min(record.field("volume_ratio")[:]))
    whole = record.outcome == FINISHED and smallest > 0.0
    return Measurement(
        quantity="smallest J of any particle",
        value=smallest,
        unit="1",
        source="matter does not turn inside out",
        verdict="whole" if whole else "turned inside out, or ended early",
        passed=whole,
    )
