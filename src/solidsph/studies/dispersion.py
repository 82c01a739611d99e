"""Waves on an endless lattice: growth and frequency of every wavelength at once.

Far from the surface of a uniformly stretched block every particle sees the same neighbours, so the
derivative of the accelerations by the positions is one block of columns, shifted: the deviation
exp(i k . p) of the particle at place p of the lattice is a mode, and its eigenvalues are those of
the Fourier sum of that block. Where `spectrum` solves a dense eigenvalue problem of all particles,
this moves a single one, once along each axis.
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
from solidsph.studies.spectrum import RELATIVE_STEP

# Beside the largest derivative: differences leave 1e-11 of it.
_UNIFORM = 1e-7

# Wave vectors times particles that answer, at a time: complex numbers of 16 bytes.
_PHASES = 1 << 22


@attrs.frozen(eq=False)
class LatticeResponse:
    """How the particles of an endless lattice answer to one that is moved."""

    places: NDArray[np.int64]  # (m, d) of those that answer, from the one moved [spacings]
    blocks: Array  # (m, d, d) derivative of their accelerations by its position [1/s^2]

    @property
    def reach(self) -> int:
        """How far along an axis the farthest of them is [spacings]."""
        return int(np.abs(self.places).max(initial=0))

    def symbols(self, wave_vectors: Array) -> NDArray[np.complex128]:
        """The matrices (k, d, d) [1/s^2] whose eigenvalues are the squares of the exponents.

        Args:
            wave_vectors: advance of the phase from particle to particle along each axis, (k, d).
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
    """How a lattice answers about its uniform `state`, from the particle nearest to its middle.

    Raises:
        SolidsphError: the particles are not the points of a lattice in rows along the axes, or so
            few that the surface reaches the middle.
    """
    particles = dynamics.particles
    middle, spacing, exact = _middle(particles)
    places = np.rint(exact).astype(np.int64)
    # A lattice is placed to rounding; a jitter worth the name moves its particles farther.
    if np.abs(exact - places).max() > 1e-6:
        raise SolidsphError(
            "the particles do not stand in rows one spacing apart, so waves have no wave vector; "
            "take a 'lattice' whose spacing divides the body, or `spectrum`"
        )
    # At a surface the state may be no state at all: only what reaches the middle must be one.
    with np.errstate(all="ignore"):
        blocks = _columns(dynamics, state, middle, spacing, particles.dimension)
    finite = np.all(np.isfinite(blocks), axis=(1, 2))
    answering = np.any(blocks != 0.0, axis=(1, 2)) & finite
    found = LatticeResponse(places[answering], blocks[answering])
    if np.any(np.abs(places[~finite]).max(axis=1, initial=0) <= found.reach):
        raise SolidsphError(
            "forces about this state are not finite; take a stretch at which the scheme and the "
            "material have a response"
        )
    depth = int(min(-places.min(axis=0).max(), places.max(axis=0).min()))
    # A particle that answers to the middle one looks as far to its other side.
    if 2 * found.reach >= depth:
        row = "bar" if particles.dimension == 1 else "row"
        raise SolidsphError(
            f"a particle answers to the {found.reach} on either side, and the {row} of "
            f"{2 * depth + 1} ends too near its middle; take at least {4 * found.reach + 3} "
            "particles"
        )
    return found


def check_uniform(dynamics: Dynamics, state: State, response: LatticeResponse) -> None:
    """That a particle beside the middle is answered like the middle one.

    Raises:
        SolidsphError: it is not, so what is found from one particle does not hold for the others.
    """
    _, spacing, exact = _middle(dynamics.particles)
    places = np.rint(exact).astype(np.int64)
    beside = np.zeros(places.shape[1], dtype=np.int64)
    beside[0] = 1
    other = int(np.flatnonzero(np.all(places == beside, axis=1))[0])
    with np.errstate(all="ignore"):
        found = _columns(dynamics, state, other, spacing, 1)[:, :, 0]
    index = {tuple(place): k for k, place in enumerate(places.tolist())}
    shifted = found[[index[tuple(place)] for place in (response.places + beside).tolist()]]
    expected = response.blocks[:, :, 0]
    error = float(np.abs(shifted - expected).max() / np.abs(expected).max())
    if not error <= _UNIFORM:
        raise SolidsphError(
            f"two particles of the lattice are answered differently, by {error:.1e}: a part "
            "depends on the body as a whole, or on where it stands, so waves have no wave vector; "
            "take `spectrum` of a body, or another gradient: of one that wraps another the inner "
            "one, which it is on a lattice"
        )


def _middle(particles: Particles) -> tuple[int, float, Array]:
    """The particle nearest to the middle, its spacing [m], and from it all in spacings (n, d)."""
    X = particles.positions
    middle = int(np.argmin(np.linalg.norm(X - 0.5 * (X.min(axis=0) + X.max(axis=0)), axis=1)))
    spacing = float(particles.spacings[middle])
    return middle, spacing, (X - X[middle]) / spacing


def _columns(dynamics: Dynamics, state: State, moved: int, spacing: float, axes: int) -> Array:
    """Derivative of all accelerations by the position of one particle along the first axes,
    (n, d, axes) [1/s^2]."""
    h = RELATIVE_STEP * spacing
    rest = np.zeros_like(state.velocities)
    columns = []
    for axis in range(axes):
        values = []
        for k in (-2, -1, 1, 2):
            positions = state.positions.copy()
            positions[moved, axis] += k * h
            placed = dynamics.place(state.time, positions)
            values.append(dynamics.respond(state.time, placed, rest).accelerations)
        # Where no difference is, none must be left by rounding: so far the particle reaches.
        fourth = (values[0] - values[3]) - 8.0 * (values[1] - values[2])
        columns.append(fourth / (12.0 * h))
    return np.stack(columns, axis=2)
