"""Waves on an endless lattice: growth and frequency of all wavelengths at once.

Far from the surface of a uniformly stretched block all particles have the same neighbours. The
derivative of the accelerations with respect to the positions is then one block of columns, shifted.
So the deviation exp(i k . p) of the particle at place p is a mode, whose exponents are those of the
Fourier sum of that block. While `spectrum` solves a dense eigenvalue problem of all particles, this
moves a single one along each axis.
"""

from __future__ import annotations

from math import pi

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles, State
from solidsph.run.dynamics import Dynamics
from solidsph.studies.spectrum import perturbed_accelerations

# Difference of two responses over the largest derivative that is accepted: rounding leaves 1e-11.
_UNIFORM = 1e-7

# Wave vectors times particles handled at a time: complex numbers of 16 bytes.
_PHASES = 1 << 22


@attrs.frozen(eq=False)
class LatticeResponse:
    """Response of the particles of an endless lattice to the motion of one of them."""

    places: NDArray[np.int64]  # (m, d) of those that respond, from the moved one [spacings]
    blocks: Array  # (m, d, d) derivative of their accelerations by its position [1/s^2]

    @property
    def reach(self) -> int:
        """Largest distance along an axis at which a particle responds [spacings]."""
        return int(np.abs(self.places).max(initial=0))

    def symbols(self, wave_vectors: Array) -> NDArray[np.complex128]:
        """Matrices (k, d, d) [1/s^2] whose eigenvalues are the squares of the exponents.

        Args:
            wave_vectors: phase from particle to particle along each axis, (k, d) [rad].
        """
        count = max(1, _PHASES // max(1, len(self.places)))
        parts = [
            np.tensordot(
                np.exp(-1j * (wave_vectors[first : first + count] @ self.places.T)), self.blocks, 1
            )
            for first in range(0, len(wave_vectors), count)
        ]
        return np.concatenate(parts)


@attrs.frozen(eq=False)
class Dispersion:
    """Exponents of small deviations of a bar, by wave number."""

    wave_numbers: Array  # (m,) phase from particle to particle, above 0, up to pi [rad]
    growth_rates: Array  # (m,) [1/s]
    frequencies: Array  # (m,) [rad/s]

    @property
    def growth_rate(self) -> float:
        """Fastest growth rate [1/s]; about zero if the uniform state is stable."""
        return float(self.growth_rates.max())

    @property
    def highest_frequency(self) -> float:
        """Largest angular frequency [rad/s]."""
        return float(self.frequencies.max())


def dispersion(dynamics: Dynamics, state: State, wave_numbers: int = 200) -> Dispersion:
    """Exponents of small deviations from the uniform `state` of a bar, found at its middle.

    Raises:
        SolidsphError: the scene is not a bar, or so short that its ends influence the middle.
    """
    dimension = dynamics.particles.dimension
    if dimension != 1:
        raise SolidsphError(
            f"the waves of a {dimension}D scene have no single wave number; "
            "take `spectrum` or `lattice_response`, or a bar"
        )
    k = pi * np.arange(1, wave_numbers + 1) / wave_numbers
    exponents = np.sqrt(lattice_response(dynamics, state).symbols(k[:, None])[:, 0, 0])
    return Dispersion(k, exponents.real, np.abs(exponents.imag))


def lattice_response(dynamics: Dynamics, state: State) -> LatticeResponse:
    """Response of a lattice in a uniform `state` to the particle nearest to its middle.

    Raises:
        SolidsphError: the particles are not a lattice along the axes, or so few that the surface
            influences the middle.
    """
    particles = dynamics.particles
    middle, exact = _middle(particles)
    places = np.rint(exact).astype(np.int64)
    # Lattices are exact to rounding; any real jitter is larger.
    if np.abs(exact - places).max() > 1e-6:
        raise SolidsphError(
            "the particles do not stand in rows one spacing apart, so waves have no wave vector; "
            "take a 'lattice' whose spacing divides the body, or `spectrum`"
        )
    # At the surface the state may not be finite; only what influences the middle must be.
    with np.errstate(all="ignore"):
        blocks = _columns(dynamics, state, middle, particles.dimension)
    finite = np.all(np.isfinite(blocks), axis=(1, 2))
    answering = np.any(blocks != 0.0, axis=(1, 2)) & finite
    response = LatticeResponse(places[answering], blocks[answering])
    if np.any(np.abs(places[~finite]).max(axis=1, initial=0) <= response.reach):
        raise SolidsphError(
            "forces about this state are not finite; take a stretch at which the scheme and the "
            "material have a response"
        )
    depth = int(min(-places.min(axis=0).max(), places.max(axis=0).min()))
    # A particle that responds to the middle one depends on as many on its other side.
    if 2 * response.reach >= depth:
        row = "bar" if particles.dimension == 1 else "row"
        raise SolidsphError(
            f"a particle responds to the {response.reach} on either side, and the {row} of "
            f"{2 * depth + 1} ends too near its middle; take at least {4 * response.reach + 3} "
            "particles"
        )
    return response


def check_uniform(dynamics: Dynamics, state: State, response: LatticeResponse) -> None:
    """Check that a particle beside the middle has the same response as the middle one.

    Raises:
        SolidsphError: it has not, so that one particle does not stand for the others.
    """
    _, exact = _middle(dynamics.particles)
    places = np.rint(exact).astype(np.int64)
    beside = np.zeros(places.shape[1], dtype=np.int64)
    beside[0] = 1
    other = int(np.flatnonzero(np.all(places == beside, axis=1))[0])
    with np.errstate(all="ignore"):
        columns = _columns(dynamics, state, other, 1)[:, :, 0]
    index = {tuple(place): k for k, place in enumerate(places.tolist())}
    shifted = columns[[index[tuple(place)] for place in (response.places + beside).tolist()]]
    expected = response.blocks[:, :, 0]
    error = float(np.abs(shifted - expected).max() / np.abs(expected).max())
    if not error <= _UNIFORM:
        raise SolidsphError(
            f"the responses to two particles of the lattice differ by {error:.1e}: a part depends "
            "on the body as a whole, or on where it stands, so waves have no wave vector; take "
            "`spectrum` of a body, or another gradient: instead of one that wraps another the "
            "inner one, which is the same on a lattice"
        )


def _middle(particles: Particles) -> tuple[int, Array]:
    """The particle nearest to the middle, and all positions (n, d) from it in its spacings."""
    X = particles.positions
    middle = int(np.argmin(np.linalg.norm(X - 0.5 * (X.min(axis=0) + X.max(axis=0)), axis=1)))
    return middle, (X - X[middle]) / float(particles.spacings[middle])


def _columns(dynamics: Dynamics, state: State, moved: int, axes: int) -> Array:
    """Derivative of all accelerations by the position of one particle along the first axes,
    (n, d, axes) [1/s^2]."""
    columns = []
    for axis in range(axes):
        h, (a, b, c, d) = perturbed_accelerations(dynamics, state, moved, axis)
        # In this order equal values leave exactly 0, which shows how far a particle acts.
        columns.append(((a - d) - 8.0 * (b - c)) / (12.0 * h))
    return np.stack(columns, axis=2)
