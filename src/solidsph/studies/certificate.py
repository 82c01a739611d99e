"""Certificate of a scheme: the waves of a uniformly stretched lattice.

On an endless lattice every small deviation is a sum of waves, each with its own exponent
(`studies.dispersion`). They show, before any run, which waves cost no energy, which grow, the
largest stable step, and the error of wave speeds. A small free body adds the modes of a surface
(`studies.spectrum`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from math import pi
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter
from scipy.optimize import minimize

from solidsph.conformance.ellipticity import acoustic_tensors, least_stiffness
from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first
from solidsph.run.cfl_step import cfl_step
from solidsph.simulation import Simulation
from solidsph.studies.dispersion import LatticeResponse, check_uniform, lattice_response
from solidsph.studies.scheme import Scheme, deformation, stretched
from solidsph.studies.spectrum import spectrum
from solidsph.system import html

GROWS = 5e-4
"""Growth rate above which a wave grows [e-foldings per wave transit of one spacing]. Rounding gives
a neutral mode 1e-4, the square root of the error of its eigenvalue."""

SOFT = 1e-2
"""Speed below which a wave counts as free of energy, relative to a shear wave [-]."""

# Wave numbers along each axis between 0 and pi; extremes are then refined between them.
_GRID = {1: 400, 2: 40, 3: 14}

# Softness of waves a tenth of a radian, half a cell of the coarsest grid, from a zero-energy wave.
_SOFT_ON_GRID = 0.05

# Smallest wave number [rad]: shorter ones drown in rounding, and 0 is the translation.
_LONGEST = 1e-3

# Extremes that are reported; the rest are similar waves.
_MOST = 8

# Extremes closer than this are the same [rad].
_SAME = 1e-2

# Layers around the middle of the free body along each axis: enough for edges and an inside.
_FREE = {1: (8,), 2: (4, 3), 3: (2, 2, 1)}

# Frequency below which a mode of the free body costs no energy, over the highest one: rounding
# leaves 1e-6, and the slowest bending of so small a body has some hundredths.
_STILL = 1e-3

# Rigid motion by which stiffness is differenced [spacings]: its square is negligible.
_TINY = 1e-4

_LARGE = 1e9  # in place of infinity, which the minimiser cannot subtract
_SEARCH: Any = {"xatol": 1e-7, "fatol": 1e-14, "maxiter": 400}

WAVELENGTHS = (2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 40.0)
"""Wavelengths at which wave speeds are reported [spacings]."""


@attrs.frozen(eq=False)
class Wave:
    """A wave of the lattice, in units of the spacing and of its transit by a confined wave."""

    wave_vector: Array  # (d,) phase from particle to particle along each axis [rad]
    polarisation: Array  # (d,) direction of its displacement, real part, normalised
    growth_rate: float  # [1/transit]
    frequency: float  # [rad/transit]
    softness: float  # squared speed over that of a shear wave; negative where it grows [-]
    count: int  # polarisations with this wave vector that grow, or otherwise cost no energy

    @property
    def wavelength(self) -> float:
        """[spacings]"""
        return float(2.0 * pi / np.linalg.norm(self.wave_vector))


@attrs.frozen(eq=False)
class FreeBody:
    """Modes of a small free body, unstretched."""

    particles: int
    rigid_modes: int  # translations and rotations without energy: should be 1, 3 or 6
    zero_modes: int  # further modes without energy
    growth_rate: float  # [1/transit]
    highest_frequency: float  # [rad/transit]
    critical_step: float  # [transits]


@attrs.frozen(eq=False)
class Certificate:
    """Stability and accuracy of a scheme at one uniform stretch."""

    scheme: Scheme
    stretches: tuple[float, ...]  # along each axis
    elliptic: bool  # whether the material itself carries waves in every direction
    mean_stress: float  # over lambda + 2 mu; positive in tension [-]
    zero_modes: tuple[Wave, ...]  # zero-energy waves
    growing: tuple[Wave, ...]  # local maxima of the growth rate, the fastest first
    fastest: Wave  # wave of the highest frequency
    critical_step: float  # largest stable step on the endless lattice [transits]
    rule_step: float  # CFL step, the longest that a scene takes [transits]
    wavelengths: Array  # (m,) along the first axis [spacings]
    speeds: Array  # (m, d) over the exact ones: longitudinal first, then transverse [-]
    free: FreeBody | None  # only unstretched: otherwise a free body is not in equilibrium

    @property
    def dimension(self) -> int:
        """1, 2 or 3."""
        return len(self.stretches)

    @property
    def growth_rate(self) -> float:
        """Growth rate of the fastest growing wave [1/transit]; 0 if none grows."""
        return self.growing[0].growth_rate if self.growing else 0.0

    @property
    def of_cfl(self) -> float:
        """Critical step over the CFL step, on the endless lattice and in the free body [-]."""
        steps = [self.critical_step, *([] if self.free is None else [self.free.critical_step])]
        return min(steps) / self.rule_step

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        return html.heading("Certificate") + html.of_values(
            {
                "stretches": ", ".join(f"{stretch:g}" for stretch in self.stretches),
                "material is elliptic": self.elliptic,
                "zero-energy waves": len(self.zero_modes),
                "growth rate [1/transit]": self.growth_rate,
                "cause of growth": self.cause or "none",
                "critical step [transits]": self.critical_step,
                "critical step over the CFL step": self.of_cfl,
            }
        )

    @property
    def cause(self) -> str:
        """Cause of growth: "material", "tensile", "pairing", or "" if no wave grows.

        A material that has lost ellipticity must be unstable. Otherwise the scheme is the cause:
        a tensile instability under tensile mean stress, pairing under compressive.
        """
        if not self.growing:
            return ""
        if not self.elliptic:
            return "material"
        return "tensile" if self.mean_stress > 0.0 else "pairing"


def certificate(
    scheme: Scheme, dimension: int, stretch: float | Sequence[float] = 1.0
) -> Certificate:
    """Certify a scheme at a uniform stretch.

    Args:
        scheme: kernel, cover, formulation with its gradient and divergence, material, effects.
        dimension: 1, 2 or 3.
        stretch: of all axes, or one for each.

    Raises:
        SceneError: a stretch is not positive, or the block of particles would be too large.
        BuildError: parts of the scheme do not fit each other, or no neighbours are left.
        SolidsphError: a part depends on the body as a whole.
    """
    stretches = _checked(dimension, stretch)
    response, simulation_step, rate = _response(scheme, stretches)
    unit = scheme.transit
    waves = _Waves(scheme, response, dimension)
    grid = waves.grid()
    softness, rates, frequencies = waves.measured(grid)
    soft = waves.extremes(grid, softness, waves.softness, below=_SOFT_ON_GRID)
    growing = waves.extremes(grid, -rates, lambda k: -waves.wave(k).growth_rate, below=-GROWS)
    # Zero-energy waves are minima of the energy, not places where it changes sign.
    zero = [w for w in soft if abs(w.softness) <= SOFT**2 and w.growth_rate <= GROWS]
    (fastest, *_) = waves.extremes(
        grid, -frequencies, lambda k: -waves.wave(k).frequency, below=-0.99 * frequencies.max()
    )
    F = deformation(stretches)
    return Certificate(
        scheme=scheme,
        stretches=stretches,
        elliptic=least_stiffness(scheme.material, F).value > 0.0,
        mean_stress=_mean_stress(scheme, F),
        zero_modes=tuple(zero),
        growing=tuple(growing),
        fastest=fastest,
        critical_step=scheme.integrator.stable_step(fastest.frequency, rate * unit),
        rule_step=simulation_step / unit,
        wavelengths=np.array(WAVELENGTHS),
        speeds=waves.speeds(F),
        free=_free_body(scheme, dimension, rate) if set(stretches) == {1.0} else None,
    )


@attrs.frozen(eq=False)
class _Waves:
    """Waves of a lattice, in units of spacing and transit."""

    scheme: Scheme
    response: LatticeResponse
    dimension: int

    def grid(self) -> Array:
        """Wave vectors (n, ..., d) between 0 and pi along each axis [rad]."""
        axis = np.linspace(0.0, pi, _GRID[self.dimension] + 1)
        return np.stack(np.meshgrid(*[axis] * self.dimension, indexing="ij"), axis=-1)

    def symbols(self, wave_vectors: Array) -> NDArray[np.complex128]:
        """Matrices (k, d, d) of `LatticeResponse.symbols` [1/transit^2]."""
        return self.response.symbols(wave_vectors) * self.scheme.transit**2

    def measured(self, grid: Array) -> tuple[Array, Array, Array]:
        """Softness, growth rate and highest frequency (n, ...) on a grid of wave vectors."""
        flat = grid.reshape(-1, self.dimension)
        squares = np.linalg.eigvals(self.symbols(flat))
        exponents = np.sqrt(squares)
        lengths = np.sum(flat**2, axis=1) * self._shear
        lengths[0] = np.inf  # the translation
        softness = (-squares.real).min(axis=1) / lengths
        softness[0] = np.inf
        measures = (softness, exponents.real.max(axis=1), np.abs(exponents.imag).max(axis=1))
        softness, rates, frequencies = (values.reshape(grid.shape[:-1]) for values in measures)
        return softness, rates, frequencies

    @property
    def _shear(self) -> float:
        """Squared speed of a shear wave over that of a confined one; 1 in 1D."""
        lam, mu = self.scheme.material.lame_parameters
        return 1.0 if self.dimension == 1 else mu / (lam + 2.0 * mu)

    def softness(self, wave_vector: Array) -> float:
        """Least squared speed of a wave over that of a shear wave."""
        length = float(wave_vector @ wave_vector)
        if length < _LONGEST**2:
            return np.inf
        squares = np.linalg.eigvals(self.symbols(wave_vector[None])[0])
        return float((-squares.real).min() / (length * self._shear))

    def wave(self, wave_vector: Array) -> Wave:
        """The fastest growing wave with a wave vector, or the softest if none grows."""
        squares, modes = np.linalg.eig(self.symbols(wave_vector[None])[0])
        exponents = np.sqrt(squares)
        grows = float(exponents.real.max()) > GROWS
        chosen = int(np.argmax(exponents.real if grows else squares.real))
        mode = modes[:, chosen]
        mode = (mode / mode[np.argmax(np.abs(mode))]).real
        slow = np.abs(squares) <= SOFT**2 * float(wave_vector @ wave_vector) * self._shear
        return Wave(
            wave_vector=wave_vector,
            polarisation=mode / np.linalg.norm(mode),
            growth_rate=float(exponents.real.max()),
            frequency=float(np.abs(exponents.imag).max()),
            softness=self.softness(wave_vector),
            count=int(np.sum(exponents.real > GROWS) if grows else np.sum(slow)),
        )

    def extremes(
        self, grid: Array, values: Array, measure: Callable[[Array], float], *, below: float
    ) -> list[Wave]:
        """Waves at the lowest local minima of a measure, the lowest first.

        Args:
            grid: wave vectors (n, ..., d).
            values: the measure on the grid, (n, ...).
            measure: the measure at any wave vector (d,).
            below: limit of the values on the grid that are considered.
        """
        neighbourhood = minimum_filter(values, size=3, mode="nearest")
        minima = np.argwhere((values <= neighbourhood) & (values < below))
        order = np.argsort([values[tuple(index)] for index in minima], kind="stable")
        width = pi / _GRID[self.dimension]
        extremes: list[tuple[float, Array]] = []
        for index in minima[order[: 4 * _MOST]]:
            start = grid[tuple(index)]
            bounds = [(max(0.0, k - width), min(pi, k + width)) for k in start]
            k = _least(measure, start, bounds)
            if all(np.abs(k - other).max() > _SAME for _, other in extremes):
                extremes.append((measure(k), k))
        extremes.sort(key=lambda minimum: minimum[0])
        return [self.wave(k) for _, k in extremes[:_MOST]]

    def speeds(self, F: Array) -> Array:
        """Phase speeds along the first axis over the exact ones (m, d); nan where a wave grows."""
        k = np.zeros((len(WAVELENGTHS), self.dimension))
        k[:, 0] = 2.0 * pi / np.array(WAVELENGTHS)
        lam, mu = self.scheme.material.lame_parameters
        along = np.eye(self.dimension)[:1]
        exact = acoustic_tensors(self.scheme.material, F, along)[0] / (lam + 2.0 * mu)
        squares = np.real(np.einsum("kii->ki", -self.symbols(k))) / k[:, :1] ** 2
        # On a lattice along the axes of stretch, waves along an axis are polarised along axes.
        ratios = squares / np.diag(exact)
        # A slightly negative square is the rounding of a zero-energy wave, not growth.
        return np.sqrt(np.where(ratios > -(SOFT**2), np.maximum(ratios, 0.0), np.nan))


def _least(
    measure: Callable[[Array], float], start: Array, bounds: Sequence[tuple[float, float]]
) -> Array:
    """Local minimum (d,) of a measure near `start` (d,), within bounds of each component."""

    def finite(wave_vector: Any) -> Any:
        return min(measure(wave_vector), _LARGE)

    result: Any = minimize(
        finite, start, method="Nelder-Mead", bounds=list(bounds), options=_SEARCH
    )
    return np.asarray(result.x) if result.fun < measure(start) else start


def _checked(dimension: int, stretch: float | Sequence[float]) -> tuple[float, ...]:
    if dimension not in (1, 2, 3):
        raise SceneError(f"a certificate has 1, 2 or 3 dimensions, not {dimension!r}")
    stretches = np.asarray(stretch, dtype=np.float64)
    if stretches.ndim == 0:
        stretches = np.full(dimension, float(stretches))
    if stretches.shape != (dimension,) or not np.all((stretches > 0.0) & np.isfinite(stretches)):
        raise SceneError(
            f"stretch must be one positive number, or one for each of {dimension} axes, got "
            f"{stretch!r}; 1 is unstretched"
        )
    return tuple(stretches.tolist())


def _response(scheme: Scheme, stretches: Sequence[float]) -> tuple[LatticeResponse, float, float]:
    """Response of the lattice, CFL step [s] and the damping rate that effects declare [1/s]."""
    dimension = len(stretches)
    layers = [scheme.depth(min(stretches))] * dimension
    simulation = scheme.deep_inside.simulation(dimension, layers)
    rate = sum(load.damping_rate for load in simulation.dynamics.loads)
    state = stretched(simulation, stretches)
    response = lattice_response(simulation.dynamics, state)
    check_uniform(simulation.dynamics, state, response)
    rule = cfl_step(simulation.integrator, simulation.dynamics.loads, simulation.model.bodies)
    return response, rule, rate


def _mean_stress(scheme: Scheme, F: Array) -> float:
    """Mean Cauchy stress over lambda + 2 mu."""
    lam, mu = scheme.material.lame_parameters
    P = particles_first(
        scheme.material.first_piola(components_first(F[None]), scheme.material.params), 1
    )[0]
    return float(np.trace(P @ F.T) / np.linalg.det(F) / len(F) / (lam + 2.0 * mu))


def _free_body(scheme: Scheme, dimension: int, rate: float) -> FreeBody:
    simulation = scheme.simulation(dimension, _FREE[dimension])
    modes = spectrum(simulation.dynamics, simulation.start())
    exponents = modes.growth_rates + 1j * modes.frequencies
    highest = modes.highest_frequency
    still = int(np.sum(np.abs(exponents) < _STILL * highest))
    rigid = _free_rigid_motions(simulation, (_STILL * highest) ** 2)
    return FreeBody(
        particles=simulation.particles.count,
        rigid_modes=rigid,
        zero_modes=still - rigid,
        growth_rate=modes.growth_rate * scheme.transit,
        highest_frequency=highest * scheme.transit,
        critical_step=scheme.integrator.stable_step(highest, rate) / scheme.transit,
    )


def _free_rigid_motions(simulation: Simulation, least: float) -> int:
    """Number of rigid motions that meet a stiffness below `least` [1/s^2]."""
    X = simulation.particles.positions
    dimension = X.shape[1]
    motions = [np.tile(axis, (len(X), 1)) for axis in np.eye(dimension)]
    for i, j in combinations(range(dimension), 2):
        turn = np.zeros((dimension, dimension))
        turn[i, j], turn[j, i] = -1.0, 1.0
        motions.append(X @ turn.T / float(np.abs(X).max()))
    step = _TINY * float(simulation.particles.spacings.min())
    rest = np.zeros_like(X)
    free = 0
    for motion in motions:
        there, back = (
            simulation.dynamics.respond(0.0, X + way * step * motion, rest).accelerations
            for way in (1.0, -1.0)
        )
        free += bool(np.abs(there - back).max() / (2.0 * step) < least)
    return free
