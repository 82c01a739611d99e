"""What a kernel makes of a polynomial, in closed form: the references of interpolation."""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import attrs
import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import quad

from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array

# A quartic has no higher derivatives.
_DEGREE = 4


@attrs.frozen
class Moments:
    """Moments of W and of -dW/dr by the distance r, over both sides of a particle.

    By Taylor's series about x, with x' - x = +-r, the sum or integral of f(x') W is
    sum over even j of f^(j)(x) / j! m_j, and that of f(x') dW/dx is
    sum over odd j of f^(j)(x) / j! s_j: what is missing of m_0 = 1, s_1 = 1 is an error of its own,
    and the next terms are the smoothing, m_2 / 2 f'' and s_3 / 6 f'''.
    """

    value: tuple[float, ...]  # m_j [m^j]
    slope: tuple[float, ...]  # s_j [m^(j-1)]

    def smoothed(self, f: Polynomial) -> Polynomial:
        """<f> where the support is complete."""
        return _series(f, self.value, range(0, _DEGREE + 1, 2))

    def differentiated(self, f: Polynomial) -> Polynomial:
        """<df/dx> where the support is complete."""
        return _series(f, self.slope, range(1, _DEGREE + 1, 2))

    def smoothed_at_left_end(self, f: Polynomial) -> Polynomial:
        """<f> where there is nothing on the left, and a particle's own half cell on the right."""
        return 0.5 * _series(f, self.value, range(_DEGREE + 1))

    def differentiated_at_left_end(self, f: Polynomial) -> Polynomial:
        """<df/dx> there; without f = 0 it grows as 1/H when the support shrinks."""
        return 0.5 * _series(f, self.slope, range(_DEGREE + 1))


def _series(f: Polynomial, moments: tuple[float, ...], orders: range) -> Polynomial:
    return sum((moments[j] / factorial(j) * f.deriv(j) for j in orders), Polynomial([0.0]))


def of_continuum(kernel: SmoothingKernel) -> Moments:
    """By integrals over the support: infinitely many particles."""
    H = kernel.support_radius
    knots = [knot * H for knot in kernel.kernel.knots]

    def integral(g: Callable[[Array], Array], j: int) -> float:
        def integrand(r: float) -> float:
            return 2.0 * r**j * float(g(np.array([r]))[0])

        return float(quad(integrand, 0.0, H, points=knots or None, epsabs=0.0, epsrel=1e-10)[0])

    return Moments(
        value=tuple(integral(kernel.value, j) for j in range(_DEGREE + 1)),
        slope=tuple(integral(lambda r: -kernel.slope(r), j) for j in range(_DEGREE + 1)),
    )


def of_lattice(kernel: SmoothingKernel, spacing: float) -> Moments:
    """By sums over a lattice that goes on in both directions."""
    r = spacing * np.arange(np.ceil(kernel.support_radius / spacing) + 1.0)
    weights = np.where(r > 0.0, 2.0, 1.0) * spacing
    W, slope = weights * kernel.value(r), weights * kernel.slope(r)
    return Moments(
        value=tuple(float(W @ r**j) for j in range(_DEGREE + 1)),
        slope=tuple(float(-slope @ r**j) for j in range(_DEGREE + 1)),
    )
