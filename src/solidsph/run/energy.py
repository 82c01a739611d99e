"""The energy ledger: kinetic and strain energy against the work of everything that acts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from solidsph.interfaces.terms import EnergyTerm, Observation, Term

KINETIC, STRAIN, RESIDUAL = "kinetic energy [J]", "strain energy [J]", "energy residual [J]"
DISSIPATED = "dissipated energy [J]"
"""Columns of every record; what is dissipated only where a material dissipates."""

BY_BODY = ("kinetic", "strain")
"""Energies that a record of several bodies also tells of each."""


def kinetic_energy(observation: Observation) -> float:
    """Sum of m v^2 / 2 [J, per unit of the missing dimensions]."""
    return 0.5 * float(observation.masses @ observation.squared_speeds)


def strain_energy(observation: Observation) -> float:
    """Sum of V psi over the particles that have a mass [J]."""
    if "strain energy" not in observation.made:
        particles = observation.particles
        real = ~particles.ghosts
        own = float(particles.volumes[real] @ observation.energy_densities[real])
        observation.made["strain energy"] = own
    found: float = observation.made["strain energy"]
    return found


def dissipated_energy(observation: Observation) -> float | None:
    """Sum of V d over the particles [J]; None where no material dissipates."""
    lost = observation.dissipated_densities
    return None if lost is None else float(observation.particles.volumes @ lost)


def total_energy(observation: Observation) -> float:
    """Of the bodies: kinetic, strain, and what their materials have dissipated so far [J]."""
    lost = dissipated_energy(observation) or 0.0
    return kinetic_energy(observation) + strain_energy(observation) + lost


def residual(observation: Observation, initial: float) -> float:
    """What no account explains of the change since the start, where there was `initial` [J]."""
    return total_energy(observation) - initial - sum(observation.state.work.values())


def ledger(
    observation: Observation, initial: float, conditions: Sequence[Term] = ()
) -> Mapping[str, float]:
    """Columns "quantity [unit]" of the accounts; `initial` is the energy at the start [J].

    Of several bodies also what each has, and what `conditions` store in each.
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
