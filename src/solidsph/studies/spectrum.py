"""Spectrum of the discrete system, linearised numerically at a state.

Small deviations from an equilibrium obey d'' = A d, where A is the derivative of the accelerations
with respect to the free positions. An eigenvalue -w^2 is a vibration of angular frequency w. An
eigenvalue whose square root has a positive real part s is a deviation that grows as exp(s t).
"""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array, Mask
from solidsph.model.particles import State
from solidsph.run.dynamics import Dynamics

# Step of differences over the spacing: the error of the fourth order formula, its fourth power, is
# then near the rounding of the accelerations.
_RELATIVE_STEP = 1e-3

MOST_FREEDOMS = 4000
"""Degrees of freedom above which the dense eigenvalue problem would take minutes."""


@attrs.frozen(eq=False)
class Spectrum:
    """Growth rates and frequencies of all modes of small deviations."""

    growth_rates: Array  # (k,) real parts of the exponents, in descending order [1/s]
    frequencies: Array  # (k,) angular frequencies in the same order [rad/s]
    modes: Array  # (k, k) columns: displacements of the free degrees of freedom
    free: Mask  # (n, d) free degrees of freedom, the rows of `modes`

    @property
    def growth_rate(self) -> float:
        """Fastest growth rate [1/s]; about zero if the state is stable."""
        return float(self.growth_rates[0])

    @property
    def highest_frequency(self) -> float:
        """Largest angular frequency [rad/s]; the integrator's limit over it is the stable step."""
        return float(self.frequencies.max())


def stiffness(dynamics: Dynamics, state: State) -> tuple[Array, Mask]:
    """Matrix A (k, k) [1/s^2] and the mask (n, d) of its free degrees of freedom.

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
    columns = []
    for particle, axis in np.argwhere(free):
        h, values = perturbed_accelerations(dynamics, state, particle, axis)
        a, b, c, d = (value[free] for value in values)
        columns.append((a - 8.0 * b + 8.0 * c - d) / (12.0 * h))
    return np.column_stack(columns), free


def perturbed_accelerations(
    dynamics: Dynamics, state: State, particle: int, axis: int
) -> tuple[float, list[Array]]:
    """A step h [m], and accelerations (n, d) [m/s^2] with a coordinate moved by -2h, -h, h, 2h."""
    h = _RELATIVE_STEP * float(dynamics.particles.spacings[particle])
    rest = np.zeros_like(state.velocities)
    values = []
    for k in (-2, -1, 1, 2):
        moved = state.positions.copy()
        moved[particle, axis] += k * h
        placed = dynamics.place(state.time, moved)
        values.append(dynamics.respond(state.time, placed, rest).accelerations)
    return h, values


def spectrum(dynamics: Dynamics, state: State) -> Spectrum:
    """Modes of small deviations from `state`, which should be an equilibrium."""
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
