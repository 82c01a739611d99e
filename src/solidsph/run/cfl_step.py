"""CFL step: the time of a wave across a spacing, shortened by the rates of loads."""

from __future__ import annotations

from collections.abc import Iterable

from solidsph.interfaces.body import Body
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Load
from solidsph.run.safe_step import stable_step_of


def cfl_step(integrator: Integrator, loads: Iterable[Load], bodies: Iterable[Body]) -> float:
    """CFL step by confined wave speed and spacing, shortened by the rates of the loads [s]."""
    return stable_step_of(lattice_frequency(bodies) ** 2, integrator, loads)


def lattice_frequency(bodies: Iterable[Body]) -> float:
    """Highest frequency of a lattice of masses and springs, 2 c / spacing [rad/s]."""
    wave_time = min(
        float(body.particles.spacings.min()) / body.material.wave_speed for body in bodies
    )
    return 2.0 / wave_time
