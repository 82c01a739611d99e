"""The largest step of a scene: from the wave speed, and whatever its effects add to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import sqrt

from solidsph.interfaces.body import Body
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.integrator import Integrator


def largest_step(
    integrator: Integrator, effects: Iterable[Effect], bodies: Sequence[Body]
) -> float:
    """The CFL step by confined wave speed and spacing, with what the effects add [s]."""
    rates = [(e.stiffness_rate(bodies), e.damping_rate(bodies)) for e in effects]
    return step_by_rates(integrator, rates, bodies)


def step_by_rates(
    integrator: Integrator, rates: Iterable[tuple[float, float]], bodies: Sequence[Body]
) -> float:
    """As `largest_step`, from each effect's stiffness rate [rad/s] and damping rate [1/s]."""
    rates = list(rates)
    squares = lattice_frequency(bodies) ** 2 + sum(stiffness**2 for stiffness, _ in rates)
    frequency = sqrt(squares)
    return integrator.stability_limit / (frequency + sum(damping for _, damping in rates))


def lattice_frequency(bodies: Iterable[Body]) -> float:
    """The highest of a lattice of point masses and springs, 2 c / spacing [rad/s]."""
    wave_time = min(
        float(body.particles.spacings.min()) / body.material.wave_speed for body in bodies
    )
    return 2.0 / wave_time
