"""Checks of a kernel.

Integrals are computed by adaptive Gauss-Kronrod quadrature, independently of the core's own
normalisation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.special import j0

from solidsph.conformance.check import Broken, Kit, NotPromised, Verdict, at_most, worst
from solidsph.conformance.samples import DIMENSIONS
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import (
    UNIT_SPHERE,
    SmoothingKernel,
    profile_slope,
    smoothing_kernel,
)
from solidsph.maths.arrays import Array

# Not 1, so that a missing or doubled factor H shows.
_RADIUS = 0.7

# A smooth integrand in double precision is integrated to a few 1e-15; a thousand of those.
MASS_TOLERANCE = 1e-12

# Wave numbers over the inverse support radius: up to half a wavelength between two particles at a
# cover of 19.
_WAVES = np.linspace(0.0, 60.0, 1201)

# Of the mass; the quadrature errs by less, a profile cut at 1e-4 of its height by about that.
_NEGATIVE = 1e-9

KIT = Kit()


def smoothed_mass(kernel: Kernel, dimension: int, support_radius: float) -> float:
    """Integral of W over space and beyond its support, for support radius [m]."""
    W = smoothing_kernel(kernel, dimension, support_radius)
    ends = [end * support_radius for end in (*_ends(kernel), 1.5)]
    return _shells(lambda r: float(W.value(np.array([r]))[0]), dimension, ends)


# What decays like exp(-1 / (1 - q)) at its edge, as mollifiers do, leaves 1e-11.
@KIT.errors(1e-9)
def knots(kernel: Kernel) -> Iterator[float]:
    """Knots lie inside, 0 < q < 1, and between them the profile is smooth, so that a few quadrature
    points are enough to integrate it."""
    wrong = [q for q in kernel.knots if not 0.0 < q < 1.0]
    if wrong:
        raise Broken(f"knots {wrong} are not inside")
    for d in DIMENSIONS:
        coarse, fine = (_gauss(kernel, d, _ends(kernel), count) for count in (40, 320))
        yield abs(coarse / fine - 1.0)


@KIT.errors(MASS_TOLERANCE)
def mass(kernel: Kernel) -> Iterator[float]:
    """The mass of W is 1 minus the declared loss, in 1, 2 and 3D."""
    for d in DIMENSIONS:
        yield abs(smoothed_mass(kernel, d, _RADIUS) - (1.0 - kernel.lost_mass(d)))


@KIT.errors(MASS_TOLERANCE)
def gradient_moment(kernel: Kernel) -> Iterator[float]:
    """The first moment of the gradient of W is minus its mass, plus a surface term where the
    profile is cut off, so that linear fields have their gradients."""
    for d in DIMENSIONS:
        W = smoothing_kernel(kernel, d, _RADIUS)
        ends = [end * _RADIUS for end in _ends(kernel)]
        moment = _shells(partial(_times_slope, W), d, ends) / d
        edge = float(W.value(np.array([_RADIUS * (1.0 - 1e-15)]))[0])
        expected = UNIT_SPHERE[d] / d * _RADIUS**d * edge - (1.0 - kernel.lost_mass(d))
        yield abs(moment - expected)


@KIT.check
def moments(kernel: Kernel) -> Verdict:
    """First moments of W are zero, second ones isotropic, positive and less than if all its mass
    were at the edge, by a sum over a fine lattice in space."""
    means, errors = [], []
    for d, count in ((1, 2001), (2, 201), (3, 61)):
        W = smoothing_kernel(kernel, d, 1.0)
        axis = (np.arange(count) + 0.5) / count * 2.0 - 1.0
        x = np.stack([grid.ravel() for grid in np.meshgrid(*[axis] * d, indexing="ij")])
        w = W.value(np.sqrt(np.sum(x**2, axis=0))) * (2.0 / count) ** d
        second = (w * x) @ x.T
        errors += [np.abs(x @ w).max(), np.abs(second - second[0, 0] * np.eye(d)).max()]
        means.append(float(np.trace(second)) / float(w.sum()))
    # Odd terms, and those that an exchange of axes maps to each other, cancel to rounding.
    passed = max(errors) <= 1e-12 and all(0.0 < mean < 1.0 for mean in means)
    listed = ", ".join(f"{mean:.4f}" for mean in means)
    return Verdict(passed, f"mean square distances {listed} H^2; asymmetry {max(errors):.1e}")


@KIT.check
def transform(kernel: Kernel) -> Verdict:
    """The Fourier transform of W is nowhere negative in 1, 2 and 3D, if so declared. Otherwise the
    first negative wave number is reported: from there on crowded neighbours may pair."""
    least: dict[int, tuple[float, float]] = {}
    for d in DIMENSIONS:
        values = _transform(kernel, d, _WAVES)
        first = np.flatnonzero(values < -_NEGATIVE)
        if first.size:
            least[d] = float(_WAVES[first[0]]), float(values.min())
    if kernel.nonnegative_transform or not least:
        lowest = min((value for _, value in least.values()), default=0.0)
        where = "nowhere negative" if not least else f"negative in {sorted(least)}D"
        return Verdict(not least, f"{where}, least {lowest:.1e} of the mass")
    listed = "; ".join(f"{d}D: {low:.0e} from k H = {k:.1f}" for d, (k, low) in least.items())
    raise NotPromised(f"negative, {listed}")


@KIT.check
def declared_loss(kernel: Kernel) -> Verdict:
    """The declared loss is the share of the profile's mass beyond q = 1; zero if it ends there."""
    # By rounding alone a profile that is zero at q = 1 may be this far from it.
    edge = float(_profile(kernel, np.array([1.0 - 1e-12]))[0]) / _height(kernel)
    profile = partial(_profile_at, kernel)
    verdicts = []
    for d in DIMENSIONS:
        lost = kernel.lost_mass(d)
        if lost == 0.0:
            verdicts.append(at_most(edge, 1e-12))
            continue
        if not edge > 0.0:
            return Verdict(False, f"declares {lost:.1e} in {d}D, but is zero at q = 1")
        inside = _shells(profile, d, _ends(kernel))
        beyond = _shells(profile, d, [1.0, np.inf])
        verdicts.append(at_most(abs(beyond / (inside + beyond) - lost), MASS_TOLERANCE))
    return worst(verdicts)


@KIT.check
def closed_normalisation(kernel: Kernel) -> Verdict:
    """The closed normalisation, if there is one, gives that mass with H = 1."""
    errors = []
    for d in DIMENSIONS:
        closed = kernel.closed_normalisation(d)
        if closed is not None:
            found = closed * _shells(partial(_profile_at, kernel), d, _ends(kernel))
            errors.append(abs(found - (1.0 - kernel.lost_mass(d))))
    return at_most(max(errors), MASS_TOLERANCE) if errors else Verdict(True, "none is given")


@KIT.check
def not_negative(kernel: Kernel) -> Verdict:
    """The profile is finite and not negative on 0 <= q < 1."""
    w = _profile(kernel, _grid())
    return Verdict(bool(np.all(np.isfinite(w)) and w.min() >= 0.0), f"least {w.min():.1e}")


# Rounding of two neighbouring values.
@KIT.errors(1e-15)
def falling(kernel: Kernel) -> Iterator[float]:
    """The profile does not rise: no neighbour weighs more than a nearer one."""
    yield float(np.diff(_profile(kernel, _grid())).max()) / _height(kernel)


@KIT.errors(0.0)
def support(kernel: Kernel) -> Iterator[float]:
    """W and its slope are zero from the support radius on."""
    r = _RADIUS * np.array([1.0, 1.0 + 1e-15, 1.5, 100.0])
    for d in DIMENSIONS:
        W = smoothing_kernel(kernel, d, _RADIUS)
        yield np.abs([W.value(r), W.slope(r)]).max()


# r / H is rounded once, which a steep slope multiplies.
@KIT.errors(1e-13)
def scaling(kernel: Kernel) -> Iterator[float]:
    """W(r, H) = W(r / H, 1) / H^d and dW/dr = dW/dr(r / H, 1) / H^(d + 1)."""
    q = _grid()
    for d in DIMENSIONS:
        unit = smoothing_kernel(kernel, d, 1.0)
        W = smoothing_kernel(kernel, d, _RADIUS)
        for scaled, of_unit, power in ((W.value, unit.value, d), (W.slope, unit.slope, d + 1)):
            expected = of_unit(q) / _RADIUS**power
            yield np.abs(scaled(_RADIUS * q) - expected).max() / np.abs(expected).max()


@KIT.errors(1e-13)
def slope(kernel: Kernel) -> Iterator[float]:
    """The slope is the derivative of the profile: between any two q its integral is the change."""
    # Gauss-Legendre panels small enough to be exact to rounding, none across a knot.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    edges = np.concatenate([np.linspace(a, b, 65)[:-1] for a, b in pairwise(_ends(kernel))])
    edges = np.append(edges, 1.0 - 1e-12)
    half = 0.5 * np.diff(edges)
    q = (edges[:-1] + half)[:, None] + half[:, None] * nodes
    change = half * (profile_slope(kernel, q) @ weights)
    yield float(np.abs(change - np.diff(_profile(kernel, edges))).max()) / _height(kernel)


@KIT.errors(1e-14)
def smooth_centre(kernel: Kernel) -> Iterator[float]:
    """The slope at q = 0 is zero, so that W has a gradient there."""
    yield float(np.abs(profile_slope(kernel, np.zeros(1))[0])) / _height(kernel)


# Elementary functions of arrays and of numbers may round differently.
@KIT.errors(1e-14)
def pointwise(kernel: Kernel) -> Iterator[float]:
    """Profile and slope give the same for a single number as for that number in an array."""
    q = _grid()[::100]
    for f in (kernel.profile, kernel.slope):
        together = f(q, kernel.params)
        if together is None:
            continue  # the author gives no slope
        alone = np.array([f(float(x), kernel.params) for x in q], dtype=np.float64)
        yield float(np.abs(together - alone).max()) / np.abs(together).max()


def _grid() -> Array:
    return np.linspace(0.0, 1.0, 10001)[:-1]


def _ends(kernel: Kernel) -> list[float]:
    return [0.0, *sorted(kernel.knots), 1.0]


def _profile(kernel: Kernel, q: Array) -> Array:
    return np.asarray(kernel.profile(q, kernel.params), dtype=np.float64)


def _profile_at(kernel: Kernel, q: float) -> float:
    return float(_profile(kernel, np.array([q]))[0])


def _height(kernel: Kernel) -> float:
    return float(np.abs(_profile(kernel, _grid())).max())


def _shells(f: Callable[[float], float], dimension: int, ends: list[float]) -> float:
    """Integral over space of a radial function, between the radii `ends`."""
    # The quadrature's own error estimate is ignored: the promise is compared with a tolerance of
    # its own, and an accuracy near rounding makes the routine warn.
    return UNIT_SPHERE[dimension] * sum(
        quad(
            lambda r: r ** (dimension - 1) * f(r), a, b, epsabs=0.0, epsrel=1e-13, full_output=True
        )[0]
        for a, b in pairwise(ends)
    )


def _quadrature(ends: list[float], count: int) -> tuple[Array, Array]:
    """Points and weights of Gauss-Legendre quadrature, `count` between each two of the `ends`."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    q = np.concatenate([a + 0.5 * (b - a) * (nodes + 1.0) for a, b in pairwise(ends)])
    w = np.concatenate([0.5 * (b - a) * weights for a, b in pairwise(ends)])
    return q, w


def _gauss(kernel: Kernel, dimension: int, ends: list[float], count: int) -> float:
    """Mass of the profile by `count` points between each two of the `ends`."""
    q, w = _quadrature(ends, count)
    return float(np.sum(w * _profile(kernel, q) * q ** (dimension - 1)))


def _times_slope(W: SmoothingKernel, r: float) -> float:
    return r * float(W.slope(np.array([r]))[0])


def _spherical_mean(phases: Array, dimension: int) -> Array:
    """Mean of exp(i k . x) over all directions, for phases |k| |x|."""
    if dimension == 1:
        return np.cos(phases)
    return np.asarray(j0(phases) if dimension == 2 else np.sinc(phases / np.pi))


def _transform(kernel: Kernel, dimension: int, wave_numbers: Array) -> Array:
    """Fourier transform of W with H = 1, over its mass, at wave numbers (m,)."""
    q, w = _quadrature(_ends(kernel), 200)
    shells = w * _profile(kernel, q) * q ** (dimension - 1)
    return np.asarray(_spherical_mean(np.outer(wave_numbers, q), dimension) @ shells / shells.sum())
