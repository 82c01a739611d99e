"""Energy ledger: kinetic, strain and dissipated energy against the work of all terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from solidsph.interfaces.terms import EnergyTerm, Observation, Term

KINETIC, STRAIN, RESIDUAL = "kinetic energy [J]", "strain energy [J]", "energy residual [J]"
DISSIPATED = "dissipated energy [J]"
"""Columns of every record; DISSIPATED only if a material dissipates."""

BY_BODY = ("kinetic", "strain")
"""Energies that a record of several bodies lists by body."""


def kinetic_energy(observation: Observation) -> float:
    """Sum of m v^2 / 2 [J]; in 1D and 2D per unit of the missing dimensions."""
    return 0.5 * float(observation.masses @ observation.squared_speeds)


def strain_energy(observation: Observation) -> float:
    """Sum of V psi over real particles [J]."""
    if "strain energy" not in observation.made:
        particles = observation.particles
        real = ~particles.ghosts
        energy = float(particles.volumes[real] @ observation.energy_densities[real])
        observation.made["strain energy"] = energy
    cached: float = observation.made["strain energy"]
    return cached


def dissipated_energy(observation: Observation) -> float | None:
    """Sum of V d over all particles [J]; None if no material dissipates."""
    lost = observation.dissipated_densities
    return None if lost is None else float(observation.particles.volumes @ lost)


def total_energy(observation: Observation) -> float:
    """Kinetic, strain and dissipated energy [J]."""
    lost = dissipated_energy(observation) or 0.0
    return kinetic_energy(observation) + strain_energy(observation) + lost


def residual(observation: Observation, initial: float) -> float:
    """Change of the total energy since `initial` [J], minus the work of all terms [J]."""
    return total_energy(observation) - initial - sum(observation.state.work.values())


def ledger(
    observation: Observation, initial: float, conditions: Sequence[Term] = ()
) -> Mapping[str, float]:
    """Columns "quantity [unit]" of all accounts; `initial` is the initial energy [J].

    For several bodies the energies of each, those stored by `conditions` included.
    """
    kinetic, strain = kinetic_energy(observation), strain_energy(observation)
    lost = dissipated_energy(observation)
    work = observation.state.work
    return {
        KINETIC: kinetic,
        STRAIN: strain,
        **({} if lost is None else {DISSIPATED: lost}),
        **{f"work of {name} [J]": value for name, value in work.items()},
        RESIDUAL: residual(observation, initial),
        **_by_body(observation, conditions),
    }


def _by_body(observation: Observation, conditions: Sequence[Term]) -> Mapping[str, float]:
    particles = observation.particles
    if len(particles.bodies) < 2:
        return {}
    kinetic = 0.5 * observation.masses * observation.squared_speeds
    strain = np.where(particles.ghosts, 0.0, particles.volumes * observation.energy_densities)
    energies = {
        **dict(zip(BY_BODY, (kinetic, strain), strict=True)),
        **{c.label: c.energies(observation) for c in conditions if isinstance(c, EnergyTerm)},
    }
    return {
        f"{name} energy of {body} [J]": float(values[rows].sum())
        for name, values in energies.items()
        for body, rows in particles.bodies.items()
    }
