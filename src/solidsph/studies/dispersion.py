"""Waves on the discrete bar without ends: growth and frequency of every wavelength at once.

Far from the ends of a uniform bar every particle sees the same neighbours, so the derivative of
the accelerations by the positions is one column, shifted: the deviation exp(i k p) of particle p is
a mode, and its eigenvalue the Fourier sum of that column. Where `spectrum` solves a dense
eigenvalue problem of all particles, this moves a single one.
"""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.arrays import Array, Indices
from solidsph.dynamics import Dynamics
from solidsph.errors import SolidsphError
from solidsph.particles import State
from solidsph.studies.spectrum import RELATIVE_STEP


@attrs.frozen(eq=False)
class Dispersion:
    """Exponents of small deviations, by wave number."""

    wave_numbers: Array  # (m,) advance of the phase from particle to particle, above 0, up to pi
    growth_rates: Array  # (m,) [1/s]
    frequencies: Array  # (m,) [rad/s]

    @property
    def growth_rate(self) -> float:
        """The fastest growth [1/s]; about zero if the uniform state is stable."""
        return float(self.growth_rates.max())

    @property
    def highest_frequency(self) -> float:
        """The largest angular frequency [rad/s]."""
        return float(self.frequencies.max())


def dispersion(dynamics: Dynamics, state: State, wave_numbers: int = 200) -> Dispersion:
    """Exponents about the uniform `state` of a bar, from the middle of it.

    Raises:
        SolidsphError: the scene is no bar, or so short that its ends reach the middle.
    """
    particles = dynamics.particles
    if particles.dimension != 1:
        raise SolidsphError(
            f"the waves of a {particles.dimension}D scene have no single wave number; "
            "take `spectrum`, or a bar"
        )
    order = np.argsort(state.positions[:, 0])
    middle = len(order) // 2
    column = _column(dynamics, state, order, middle)
    shifts = np.arange(len(order)) - middle
    reach = int(np.abs(shifts[column != 0.0]).max(initial=0))
    # A particle that answers to the middle one looks as far to its other side.
    if 2 * reach >= min(middle, len(order) - 1 - middle):
        raise SolidsphError(
            f"a particle answers to the {reach} on either side, and the bar of {len(order)} ends "
            f"too near its middle; take at least {4 * reach + 3} particles"
        )
    # At these wave numbers the phase repeats after `period` particles.
    period = 2 * wave_numbers
    folded = np.bincount(shifts % period, column, period)
    exponents = np.sqrt(np.fft.fft(folded)[1 : wave_numbers + 1])
    k = np.pi * np.arange(1, wave_numbers + 1) / wave_numbers
    return Dispersion(k, exponents.real, np.abs(exponents.imag))


def _column(dynamics: Dynamics, state: State, order: Indices, middle: int) -> Array:
    """Derivative of all accelerations by the position of the middle particle, (n,) [1/s^2]."""
    moved = order[middle]
    h = RELATIVE_STEP * float(dynamics.particles.spacings[moved])
    rest = np.zeros_like(state.velocities)
    values = []
    for k in (-2, -1, 1, 2):
        positions = state.positions.copy()
        positions[moved] += k * h
        placed = dynamics.place(state.time, positions)
        values.append(dynamics.respond(state.time, placed, rest).accelerations[order, 0])
    # Where no difference is, none must be left by rounding: that is how far the particle reaches.
    fourth: Array = ((values[0] - values[3]) - 8.0 * (values[1] - values[2])) / (12.0 * h)
    return fourth
