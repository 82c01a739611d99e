"""SmoothingKernel: a kernel normalised in one dimension and cut off at its support radius.

Where the spacing varies, so does the radius. That of a pair is the mean of the two particles', so
that a pair has one kernel value, and pair forces stay equal and opposite.
"""

from __future__ import annotations

from itertools import pairwise
from math import isclose, pi

import attrs
import numpy as np

from solidsph.errors import PluginError
from solidsph.interfaces.kernel import Kernel
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import Pairs

UNIT_SPHERE = {1: 2.0, 2: 2.0 * pi, 3: 4.0 * pi}
"""Surface of the unit sphere, by dimension."""

# Largest value at the edge, relative to the maximum, that rounding may leave of a zero.
_EDGE_TOLERANCE = 1e-12

COMPLEX_STEP = 1e-40
"""Step along the imaginary axis: so far below any q that its square vanishes; no difference
that could cancel is taken."""


@attrs.frozen(eq=False)
class SmoothingKernel:
    """W(r) = sigma_d / H^d w(r / H), zero for r >= H."""

    kernel: Kernel
    dimension: int
    support_radius: float  # H, the largest of the body [m]
    normalisation: float  # sigma_d [-]
    radii: Array | None = None  # (n,) H of each particle, where the spacing varies [m]

    def between(self, a: Indices, b: Indices) -> Array | float:
        """H of pairs of particles a and b (m,), the mean of the two: (m,), or one number [m]."""
        if self.radii is None:
            return self.support_radius
        return np.asarray(0.5 * (self.radii[a] + self.radii[b]))

    def value(self, distances: Array, radius: Array | float | None = None) -> Array:
        """W(r) at distances r (m,) [m], (m,) [m^-d]; `radius` is H of each, the largest if None."""
        H = self.support_radius if radius is None else radius
        q = np.asarray(distances) / H
        inside = q < 1.0
        w = self.kernel.profile(np.where(inside, q, 0.0), self.kernel.params)
        return np.where(inside, w, 0.0) * (self.normalisation / H**self.dimension)

    def slope(self, distances: Array, radius: Array | float | None = None) -> Array:
        """dW/dr at distances r (m,) [m], (m,) [m^-(d+1)]; `radius` as of `value`."""
        H = self.support_radius if radius is None else radius
        q = np.asarray(distances) / H
        inside = q < 1.0
        dw = profile_slope(self.kernel, np.where(inside, q, 0.0))
        return np.where(inside, dw, 0.0) * (self.normalisation / H ** (self.dimension + 1))

    def gradient(
        self, offsets: Array, distances: Array, radius: Array | float | None = None
    ) -> Array:
        """Derivative of W(x_p - x_q) by x_p, (m, d) [m^-(d+1)], from offsets x_q - x_p [m]."""
        return -self.slope_by_distance(distances, radius)[:, None] * offsets

    def slope_by_distance(self, distances: Array, radius: Array | float | None = None) -> Array:
        """dW/dr / r at distances r (m,) [m], (m,) [m^-(d+2)]; 0 at r = 0."""
        safe = np.where(distances > 0.0, distances, 1.0)
        return np.where(distances > 0.0, self.slope(distances, radius) / safe, 0.0)

    def values_of(self, pairs: Pairs) -> Array:
        """W of all pairs (m,) [m^-d]."""
        return self.value(pairs.distances, self.between(pairs.rows, pairs.columns))

    def gradients_of(self, pairs: Pairs) -> Array:
        """Derivative of W of all pairs by the place of the first particle, (m, d) [m^-(d+1)]."""
        radius = self.between(pairs.rows, pairs.columns)
        return self.gradient(pairs.offsets, pairs.distances, radius)

    def of_part(self, chosen: Indices) -> SmoothingKernel:
        """That of the chosen particles (k,) alone, renumbered in order."""
        return self if self.radii is None else attrs.evolve(self, radii=self.radii[chosen])


def profile_slope(kernel: Kernel, q: Array) -> Array:
    """dw/dq of a kernel: the author's formula, or a complex step through `profile`."""
    slope = kernel.slope(q, kernel.params)
    if slope is not None:
        return np.asarray(slope, dtype=np.float64)
    stepped = kernel.profile(np.asarray(q) + 1j * COMPLEX_STEP, kernel.params)
    return np.asarray(np.imag(stepped) / COMPLEX_STEP, dtype=np.float64)


def profile_mass(kernel: Kernel, dimension: int) -> float:
    """Integral of the profile over the unit ball, by Gauss-Legendre panels between the knots.

    Raises:
        PluginError: two numbers of panels give different values.
    """
    ends = np.array([0.0, *sorted(kernel.knots), 1.0])
    masses = [_panel_mass(kernel, dimension, ends, panels) for panels in (32, 64)]
    if not isclose(*masses, rel_tol=1e-13, abs_tol=0.0):
        raise PluginError(
            f"kernel {type(kernel).__name__}: its mass in {dimension}D does not settle under "
            f"refinement of the quadrature ({masses[0]:.17g}, then {masses[1]:.17g}); declare the "
            "places where the profile has kinks in `knots`"
        )
    return masses[1]


def _panel_mass(kernel: Kernel, dimension: int, ends: Array, panels: int) -> float:
    nodes, weights = np.polynomial.legendre.leggauss(20)
    edges = np.concatenate(
        [np.linspace(a, b, panels + 1)[:-1] for a, b in pairwise(ends)] + [ends[-1:]]
    )
    half = 0.5 * np.diff(edges)
    q = (edges[:-1] + half)[:, None] + half[:, None] * nodes
    w = kernel.profile(q, kernel.params)
    return float(
        UNIT_SPHERE[dimension] * np.sum(half[:, None] * weights * w * q ** (dimension - 1))
    )


def check_profile(kernel: Kernel) -> None:
    """Raise PluginError unless the profile is finite, not negative and zero at its edge."""
    name = f"kernel {type(kernel).__name__}"
    q = np.linspace(0.0, 1.0, 2001)[:-1]
    try:
        with np.errstate(all="ignore"):
            w = np.asarray(kernel.profile(q, kernel.params), dtype=np.float64)
            edge = float(kernel.profile(np.array([1.0 - 1e-12]), kernel.params)[0])
    except Exception as cause:  # a plugin's formula may fail in any way
        raise PluginError(
            f"{name}: profile(q, params) failed on an array: {type(cause).__name__}: {cause}; use "
            "NumPy functions and np.maximum or np.where in place of `if`"
        ) from cause
    if w.shape != q.shape:
        raise PluginError(
            f"{name}: profile gave shape {w.shape} for q of shape {q.shape}; it must give one "
            "value for each"
        )
    if not np.all(np.isfinite(w)):
        bad = q[~np.isfinite(w)][0]
        raise PluginError(
            f"{name}: profile({bad:.6g}) is not finite; it must be finite on 0 <= q < 1"
        )
    if np.any(w < 0.0):
        bad = q[w < 0.0][0]
        raise PluginError(
            f"{name}: profile({bad:.6g}) = {w[w < 0.0][0]:.6g} is negative; a weight must not be "
            "negative on 0 <= q < 1"
        )
    if not np.any(w > 0.0):
        raise PluginError(f"{name}: profile is zero everywhere; it must have a mass")
    lost = [kernel.lost_mass(d) for d in (1, 2, 3)]
    if not all(0.0 <= loss < 1.0 for loss in lost):
        raise PluginError(f"{name}: lost_mass must be in [0, 1) in every dimension, got {lost}")
    if not all(0.0 < knot < 1.0 for knot in kernel.knots):
        raise PluginError(f"{name}: knots must lie between 0 and 1, got {kernel.knots}")
    _check_slope(kernel, name, q, w)
    if edge > _EDGE_TOLERANCE * w.max() and min(lost) <= 0.0:
        raise PluginError(
            f"{name}: profile is {edge:.6g} at q = 1, where it must be zero; let it vanish there, "
            "or declare the mass that the cut loses in `lost_mass`"
        )


def _check_slope(kernel: Kernel, name: str, q: Array, w: Array) -> None:
    """Raise PluginError unless the trapezoidal integral of the slope is the profile's change."""
    try:
        with np.errstate(all="ignore"):
            slope = profile_slope(kernel, q)
    except Exception as cause:  # a plugin's formula may fail in any way
        raise PluginError(
            f"{name}: its slope failed on an array: {type(cause).__name__}: {cause}; use NumPy "
            "functions"
        ) from cause
    change = 0.5 * (slope[1:] + slope[:-1]) * np.diff(q)
    wrong = np.abs(change - np.diff(w))
    # In steps of 1/2000 the error of the rule is about 1e-10 for a smooth profile, 1e-6 at a kink.
    if not np.all(wrong < 1e-5 * w.max()):
        worst = q[int(np.argmax(np.where(np.isfinite(wrong), wrong, np.inf)))]
        raise PluginError(
            f"{name}: slope is not the derivative of profile near q = {worst:.4g}; correct it, or "
            "leave it out if profile is a formula without abs"
        )


def smoothing_kernel(
    kernel: Kernel, dimension: int, support_radius: float, radii: Array | None = None
) -> SmoothingKernel:
    """Normalise `kernel` for one dimension and support radius [m].

    `radii` (n,) [m] are those of the particles, where they differ; the largest is the other.

    Raises:
        PluginError: the profile is not a weight, or its closed normalisation is wrong.
    """
    check_profile(kernel)
    sigma = (1.0 - kernel.lost_mass(dimension)) / profile_mass(kernel, dimension)
    closed = kernel.closed_normalisation(dimension)
    if closed is not None and not isclose(sigma, closed, rel_tol=1e-11):
        raise PluginError(
            f"kernel {type(kernel).__name__}: closed_normalisation({dimension}) = {closed:.15g}, "
            f"but quadrature gives {sigma:.15g}; correct the formula or leave it out"
        )
    return SmoothingKernel(kernel, dimension, support_radius, sigma, radii)
