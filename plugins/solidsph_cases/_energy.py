"""Measurements of the energy, its ledger and the volume of particles."""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.studies.case import Measurement
from solidsph_cases._compare import finished, vanishing

_RESIDUAL = 1e-3  # of the energy in play, by the bar of the stability suite
_LEDGER = "every force has an account"


def total_energy(record: Record) -> Array:
    """Kinetic energy, strain energy and that of hourglass control if there is any, (t,) [J]."""
    energies = [
        values
        for name, values in record.history.items()
        if name.endswith("energy [J]") and not name.startswith("energy residual")
    ]
    return np.asarray(np.sum(energies, axis=0))


def energy_kept(record: Record, tolerance: float) -> Measurement:
    """Largest change of the energy of a body on which nothing acts, over that at the start."""
    energy = total_energy(record)
    change = float(np.abs(energy / energy[0] - 1.0).max())
    quantity = "largest relative change of energy"
    return vanishing(record, quantity, change, tolerance, "nothing acts on the body")


def residual_over_start(record: Record) -> Measurement:
    """Largest residual of the energy ledger over the energy at the start."""
    energy = record.history["kinetic energy [J]"][0] + record.history["strain energy [J]"][0]
    left = float(np.abs(record.history["energy residual [J]"]).max() / energy)
    quantity = "largest energy residual over the energy at the start"
    return vanishing(record, quantity, left, _RESIDUAL, _LEDGER)


def residual_over_work(record: Record, name: str) -> Measurement:
    """Largest residual of the energy ledger over its largest account."""
    largest = max(
        float(np.abs(values).max())
        for column, values in record.history.items()
        if column.startswith("work of ") or column in ("kinetic energy [J]", "strain energy [J]")
    )
    left = float(np.abs(record.history["energy residual [J]"]).max() / largest)
    quantity = f"largest energy residual over the largest account, {name}"
    return vanishing(record, quantity, left, _RESIDUAL, _LEDGER)


def smallest_volume_ratio(record: Record) -> Measurement:
    """Smallest J of any particle at any time."""
    smallest = float(np.min(record.field("volume_ratio")[:]))
    whole = finished(record) and smallest > 0.0
    return Measurement(
        "smallest J of any particle",
        smallest,
        "1",
        source="matter does not turn inside out",
        verdict="whole" if whole else "turned inside out, or ended early",
        passed=whole,
    )
