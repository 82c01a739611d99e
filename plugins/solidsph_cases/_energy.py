"""Energies and momenta of a record, as the hard cases ask for them."""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.studies.case import Measurement
from solidsph_cases._compare import FINISHED

_RESIDUAL = 1e-3  # of the energy in play, by the bar of the stability suite


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


def residual_over_start(record: Record) -> Measurement:
    """What the ledger leaves at most, over the energy at the start."""
    energy = record.history["kinetic energy [J]"][0] + record.history["strain energy [J]"][0]
    left = float(np.abs(record.history["energy residual [J]"]).max() / energy)
    return Measurement(
        quantity="largest energy residual over the energy at the start",
        value=left,
        unit="1",
        reference=0.0,
        source="every force has an account",
        error=left,
        passed=record.outcome == FINISHED and left <= _RESIDUAL,
    )


def residual_over_work(record: Record, name: str) -> Measurement:
    """What the ledger leaves at most, over the largest of its accounts."""
    accounts = [
        values
        for column, values in record.history.items()
        if column.startswith("work of ") or column in ("kinetic energy [J]", "strain energy [J]")
    ]
    largest = max(float(np.abs(one).max()) for one in accounts)
    left = float(np.abs(record.history["energy residual [J]"]).max() / largest)
    return Measurement(
        quantity=f"largest energy residual over the largest account, {name}",
        value=left,
        unit="1",
        reference=0.0,
        source="every force has an account",
        error=left,
        passed=record.outcome == FINISHED and left <= _RESIDUAL,
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
