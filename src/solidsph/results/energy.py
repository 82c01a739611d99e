"""The energy ledger: kinetic and strain energy against the work of everything that acts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from solidsph.interfaces.condition import Observation

KINETIC, STRAIN, RESIDUAL = "kinetic energy [J]", "strain energy [J]", "energy residual [J]"
"""Columns of every record."""


def kinetic_energy(observation: Observation) -> float:
    """Sum of m v^2 / 2 [J, per unit of the missing dimensions]."""
    speeds = np.sum(observation.state.velocities**2, axis=1)
    return 0.5 * float(observation.masses @ speeds)


def strain_energy(observation: Observation) -> float:
    """Sum of V psi over the particles that have a mass [J]."""
    particles = observation.particles
    real = ~particles.ghosts
    return float(particles.volumes[real] @ observation.energy_densities[real])


def ledger(observation: Observation, initial: float) -> Mapping[str, float]:
    """Columns "quantity [unit]" of the accounts; `initial` is the energy at the start [J]."""
    kinetic, strain = kinetic_energy(observation), strain_energy(observation)
    work = observation.state.work
    return {
        KINETIC: kinetic,
        STRAIN: strain,
        **{f"work of {name} [J]": value for name, value in work.items()},
        RESIDUAL: kinetic + strain - initial - sum(work.values()),
    }
