"""Runs that confirm a certificate: one wave in a block whose outer layers are held.

The held layers influence the middle no faster than waves travel. In a run that is short enough for
its block, the middle moves as on the endless lattice.
"""

from __future__ import annotations

from math import ceil, log

import attrs
import numpy as np

from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.simulation import Simulation
from solidsph.studies.certificate import Certificate, Wave
from solidsph.studies.scheme import stretched

# Initial deviation [spacings]: a million times the rounding of positions, and a millionth of what
# is no longer linear.
_START = 1e-9

# E-foldings over which growth is measured.
_FOLDINGS = 4.0

# Steps of a run near the critical step: 2 % above it a wave grows by a factor of 1.2 in each.
_STEPS = 60

# Moving layers on either side of the middle in runs near the critical step.
_MOVING = {1: 24, 2: 14, 3: 8}


def _advanced(simulation: Simulation, state: State, step: float) -> State:
    # At the surface of the held layers the state may not be finite; that does not matter.
    with np.errstate(all="ignore"):
        return simulation.integrator.advance(state, simulation.dynamics, step)


def measured_growth(certificate: Certificate) -> float:
    """Growth rate of the fastest growing wave in a run [1/transit].

    Raises:
        SolidsphError: no wave grows.
    """
    if not certificate.growing:
        raise SolidsphError("no wave grows, so there is no growth to be run; take another stretch")
    wave = certificate.growing[0]
    duration = _FOLDINGS / wave.growth_rate  # [transits]
    # Waves are at most half again as fast as the material's, for the stiffening by stretch. Fast
    # growth is over before a wave has crossed a spacing, but particles act at once over a support.
    layers = ceil(1.5 * duration * max(1.0, *certificate.stretches))
    layers += certificate.scheme.depth(min(certificate.stretches))
    simulation, start = _block(certificate, layers)
    # A hundred steps, or what is stable: the integrator's error is then at most 0.04^2 / 24.
    step = min(0.25 * certificate.critical_step, 0.01 * duration) * certificate.scheme.transit
    state, first = _begun(certificate, simulation, start, wave, step)
    for _ in range(ceil(duration * certificate.scheme.transit / step)):
        state = _advanced(simulation, state, step)
    last = _amplitude(certificate, simulation, start, state, wave)
    return log(last / first) / (state.time - start.time) * certificate.scheme.transit


def amplification(certificate: Certificate, part: float) -> float:
    """Largest amplitude over the initial one of the wave of the highest frequency, in a run of
    `_STEPS` steps at this part of the predicted critical step."""
    wave = certificate.fastest
    simulation, start = _block(certificate, _MOVING[certificate.dimension])
    step = part * certificate.critical_step * certificate.scheme.transit
    still = attrs.evolve(wave, growth_rate=0.0)
    state, first = _begun(certificate, simulation, start, still, step)
    largest = first
    for _ in range(_STEPS):
        state = _advanced(simulation, state, step)
        deviation = state.positions - start.positions
        largest = max(largest, float(np.abs(deviation).max()) / certificate.scheme.spacing)
        if largest > 1e-2:  # no longer linear
            break
    return largest / first


def _block(certificate: Certificate, moving: int) -> tuple[Simulation, State]:
    """Moving layers within layers that are held at the uniform stretch."""
    scheme, stretches = certificate.scheme, certificate.stretches
    held = scheme.depth(min(stretches))
    axes = "XYZ"[: certificate.dimension]
    edge = f"{(moving + 0.5) * scheme.spacing!r}"
    outer = " or ".join(f"abs({axis}) > {edge}" for axis in axes)
    uniform = {
        axis.lower(): f"{stretch - 1.0!r}*{axis}"
        for axis, stretch in zip(axes, stretches, strict=True)
    }
    hold = {"type": "prescribed-motion", "where": outer, "displacement": uniform}
    layers = [moving + held] * certificate.dimension
    simulation = scheme.deep_inside.simulation(
        certificate.dimension, layers, boundaries=[(hold, "held")]
    )
    return simulation, stretched(simulation, stretches)


def _shape(certificate: Certificate, simulation: Simulation, wave: Wave) -> Array:
    """Displacement (n, d) of a wave of unit amplitude."""
    places = simulation.particles.positions / certificate.scheme.spacing
    return np.cos(places @ wave.wave_vector)[:, None] * wave.polarisation


def _begun(
    certificate: Certificate, simulation: Simulation, start: State, wave: Wave, step: float
) -> tuple[State, float]:
    """First state of a run that starts in a growing wave, and its amplitude [spacings]."""
    deviation = _START * certificate.scheme.spacing * _shape(certificate, simulation, wave)
    rate = wave.growth_rate / certificate.scheme.transit
    begun = attrs.evolve(
        start,
        positions=simulation.dynamics.place(start.time, start.positions + deviation),
        velocities=simulation.dynamics.carry(start.time, rate * deviation),
    )
    first = _amplitude(certificate, simulation, start, begun, wave)
    with np.errstate(all="ignore"):
        return simulation.integrator.start(begun, simulation.dynamics, step), first


def _amplitude(
    certificate: Certificate, simulation: Simulation, start: State, state: State, wave: Wave
) -> float:
    """Amplitude of the wave at the middle particle [spacings]."""
    middle = int(np.argmin(np.linalg.norm(simulation.particles.positions, axis=1)))
    deviation = (state.positions - start.positions)[middle] / certificate.scheme.spacing
    return abs(float(deviation @ wave.polarisation))
