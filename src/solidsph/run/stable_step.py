"""The stable time step of a scene: from the wave speed, and what its loads add to it."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

from solidsph.interfaces.body import Body
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.terms import Load


def stable_step(integrator: Integrator, loads: Iterable[Load], bodies: Iterable[Body]) -> float:
    """The CFL step by confined wave speed and spacing, with what the loads add [s]."""
    loads = list(loads)
    squares = lattice_frequency(bodies) ** 2 + sum(load.stiffness_rate**2 for load in loads)
    frequency = sqrt(squares)
    return integrator.stability_limit / (frequency + sum(load.damping_rate for load in loads))


def lattice_frequency(bodies: Iterable[Body]) -> float:
    """The highest of a lattice of point masses and springs, 2 c / spacing [rad/s]."""
    wave_time = min(
        float(body.particles.spacings.min()) / body.material.wave_speed for body in bodies
    )
    return 2.0 / wave_time
