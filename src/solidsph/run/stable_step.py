"""Stable time step of a scene, from the wave speed and the rates of its loads."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

from solidsph.interfaces.body import Body
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Load


def stable_step(integrator: Integrator, loads: Iterable[Load], bodies: Iterable[Body]) -> float:
    """CFL step by confined wave speed and spacing, reduced by the rates of the loads [s]."""
    loads = list(loads)
    squares = lattice_frequency(bodies) ** 2 + sum(load.stiffness_rate**2 for load in loads)
    frequency = sqrt(squares)
    return integrator.stability_limit / (frequency + sum(load.damping_rate for load in loads))


def lattice_frequency(bodies: Iterable[Body]) -> float:
    """Highest frequency of a lattice of masses and springs, 2 c / spacing [rad/s]."""
    wave_time = min(
        float(body.particles.spacings.min()) / body.material.wave_speed for body in bodies
    )
    return 2.0 / wave_time
