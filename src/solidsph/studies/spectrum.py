"""The spectrum of the discrete system, linearised numerically about a state.

About an equilibrium, small deviations obey d'' = A d with A the derivative of the accelerations
by the free positions. An eigenvalue -w^2 is a vibration of angular frequency w; an eigenvalue
with a square root of positive real part s is a deviation that grows as exp(s t).
"""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array, Mask
from solidsph.model.particles import State
from solidsph.run.dynamics import Dynamics

# Differences over this part of a spacing: the fourth order formula's error, (step / spacing)^4,
# then stands near the rounding of the accelerations.
RELATIVE_STEP = 1e-3

MOST_FREEDOMS = 4000
"""Degrees of freedom beyond which the dense eigenvalue problem would take minutes."""


@attrs.frozen(eq=False)
class Spectrum:
    """Growth and vibration of small deviations."""

    growth_rates: Array  # (k,) real parts of the exponents of all modes, falling [1/s]
    frequencies: Array  # (k,) their angular frequencies, in the same order [rad/s]
    modes: Array  # (k, k) columns: the modes' displacements of the free degrees of freedom
    free: Mask  # (n, d) degrees of freedom that the rows of a mode belong to

    @property
    def growth_rate(self) -> float:
        """The fastest growth [1/s]; about zero if the state is stable."""
        return float(self.growth_rates[0])

    @property
    def highest_frequency(self) -> float:
        """The largest angular frequency [rad/s]: the integrator's limit over it is the step."""
        return float(self.frequencies.max())


def stiffness(dynamics: Dynamics, state: State) -> tuple[Array, Mask]:
    """A, (k, k) [1/s^2], and the free degrees of freedom (n, d) that it belongs to.

    Raises:
        SolidsphError: the system is too large for a dense matrix.
    """
    particles = dynamics.particles
    free = np.repeat(~particles.ghosts[:, None], particles.dimension, axis=1)
    for held in dynamics.held:
        free &= ~held
    count = int(free.sum())
    if count > MOST_FREEDOMS:
        raise SolidsphError(
            f"the spectrum of {count} degrees of freedom needs a dense matrix of that "
            f"size; coarsen the scene to at most {MOST_FREEDOMS}"
        )
    rest = np.zeros_like(state.velocities)

    def accelerations(positions: Array) -> Array:
        placed = dynamics.place(state.time, positions)
        response: Array = dynamics.respond(state.time, placed, rest).accelerations[free]
        return response

    columns = []
    for particle, axis in np.argwhere(free):
        h = RELATIVE_STEP * particles.spacings[particle]
        values = []
        for k in (-2, -1, 1, 2):
            moved = state.positions.copy()
            moved[particle, axis] += k * h
            values.append(accelerations(moved))
        columns.append((values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * h))
    return np.column_stack(columns), free


def spectrum(dynamics: Dynamics, state: State) -> Spectrum:
    """All modes of small deviations from `state`, which should be an equilibrium."""
    matrix, free = stiffness(dynamics, state)
    eigenvalues, modes = np.linalg.eig(matrix)
    exponents = np.sqrt(eigenvalues.astype(np.complex128))
    order = np.argsort(-exponents.real, kind="stable")
    return Spectrum(
        growth_rates=exponents.real[order],
        frequencies=np.abs(exponents.imag[order]),
        modes=modes[:, order],
        free=free,
    )
