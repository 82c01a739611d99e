"""Values between particles: a cubic field fitted to those around a point."""

from __future__ import annotations

from itertools import combinations_with_replacement
from math import comb, pi

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array
from tests.bare.scene import Fields

# The fit takes what lies within so many spacings of a point, and at least twice as many particles
# as it has coefficients: at corners the former are too few. Beside a flat face the fourth layer is
# up to 3 spacings away, and a cubic field needs several of its particles.
_REACH = 3.6
_LEAST = 2

# Of the Gaussian, in spacings. With 1, stresses along an edge that bends around a hole of 4
# spacings are smoothed: Kirsch's own field has a peak 5 % too low in a whole sheet, and is read
# right in a quarter. With 0.6 it is 0.5 % too low.
_WIDTH = 0.6

# Of the polynomials. With 2, and a width of 1, the reading at the inner edge of Lame's ring of 8
# particles across is itself off by 1.6 % of the pressure, with 3 by 0.6 %.
_DEGREE = 3


def at(rest: Fields, values: Array, points: Array) -> Array:
    """`values` (n, ...) of the particles at `points` (k, d), inside the body or on its surface."""
    return fitted(rest.places, rest.spacing, values, np.atleast_2d(points))


def fitted(
    X: Array,
    spacing: float,
    values: Array,
    points: Array,
    *,
    degree: int = _DEGREE,
    width: float = _WIDTH,
    reach: float = _REACH,
) -> Array:
    """Moving least squares of a `degree`, weighed by a Gaussian of a `width` in spacings."""
    tree, (n, d) = cKDTree(X), X.shape
    least = min(n, _LEAST * comb(d + degree, degree))
    factors = [
        list(chosen)
        for order in range(degree + 1)
        for chosen in combinations_with_replacement(range(d), order)
    ]
    rows = []
    for point, near in zip(points, tree.query_ball_point(points, reach * spacing), strict=True):
        chosen = near if len(near) >= least else tree.query(point, k=least)[1]
        offsets = (X[chosen] - point) / spacing
        squares = np.sum(offsets**2, axis=1) / width**2
        weights = np.exp(-0.25 * squares)[:, None]  # the root of the Gaussian
        terms = np.stack([offsets[:, some].prod(axis=1) for some in factors], axis=1)
        wanted = values[chosen].reshape(len(offsets), -1)
        rows.append(np.linalg.lstsq(weights * terms, weights * wanted, rcond=1e-8)[0][0])
    return np.array(rows).reshape(len(points), *values.shape[1:])


def mean_on(rest: Fields, values: Array, start: Array, end: Array, count: int = 41) -> Array:
    """Mean of `values` along the straight line between two points, by the trapezoidal rule."""
    parts = np.linspace(0.0, 1.0, count)
    points = np.outer(1.0 - parts, start) + np.outer(parts, end)
    return np.asarray(np.trapezoid(at(rest, values, points), parts, axis=0))


def zigzag(rest: Fields, values: Array) -> float:
    """What neighbours differ by beyond the smooth field around them, over the range of `values`.

    Root mean square over the body of twice the distance of a particle's value from the field
    fitted to it and its neighbours: where values alternate by a, they differ by 2 a. A linear
    field would count the curvature of the solution as well.
    """
    smooth = fitted(rest.places, rest.spacing, values, rest.places, degree=2, width=1.0, reach=3.0)
    return float(2.0 * np.sqrt(np.mean((values - smooth) ** 2)) / np.ptp(values))


def period_of(times: Array, values: Array, guess: float) -> float:
    """Period [s] of the sine, zero at the start, that fits `values` (t,) best."""
    scale = float(np.abs(values).max())

    def misfit(p: Array) -> Array:
        return np.asarray(p[1] * np.sin(2.0 * pi * times / (p[0] * guess)) - values / scale)

    return float(least_squares(misfit, [1.0, 1.0], xtol=1e-12, ftol=1e-12).x[0] * guess)
