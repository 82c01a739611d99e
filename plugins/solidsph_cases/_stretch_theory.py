"""Theory of the paper's law (eq. 15) under a stretch along one axis, the others held."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import log, sqrt

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from solidsph.maths.arrays import Array


def cauchy_stress(stretch: Array, across: float, lam: float, mu: float) -> Array:
    """sigma_11 of F = diag(stretch, across, 1) [Pa], from eqs. 21 and 22."""
    stress: Array = (mu * (stretch**2 - 1.0) + lam * np.log(stretch * across)) / (stretch * across)
    return stress


def stiffness(stretch: float, across: float, lam: float, mu: float) -> float:
    """dP_11 / dF_11 [Pa]: rho_0 times the square of a wave's speed in reference positions."""
    return mu + (mu + lam * (1.0 - log(stretch * across))) / stretch**2


def behind_first_wave(speed: float, lam: float, mu: float, density: float) -> float:
    """Stretch behind the simple wave that a sudden `speed` [m/s] of an end sends into a bar.

    The law is concave in tension, so the front fans out and v = integral of c(s) ds.
    """

    def excess(stretch: float) -> float:
        return _pulled(stretch, lam, mu, density) - speed

    return float(brentq(excess, 1.0, 2.0, xtol=1e-12))


def _pulled(stretch: float, lam: float, mu: float, density: float) -> float:
    def wave_speed(s: float) -> float:
        return sqrt(stiffness(s, 1.0, lam, mu) / density)

    return float(quad(wave_speed, 1.0, stretch)[0])


def losses(across: float | None, lam: float, mu: float, end: float) -> list[float]:
    """Stretches up to `end` where the law gains or loses ellipticity, by its closed form.

    The acoustic tensor is mu I + k g (x) g, k = lambda (1 - ln J) + mu, with g = F^-T N of length
    1 / s along the axis of stretch s: the least eigenvalue is mu + k / s^2, s the smallest stretch.

    Args:
        across: the stretch held across the pull, in plane strain; None for a bar, in which waves
            run along the pull only.
    """

    def least(stretch: float) -> float:
        held = 1.0 if across is None else across
        smallest = stretch if across is None else min(stretch, across)
        return mu * smallest**2 + mu + lam * (1.0 - log(stretch * held))

    return _zeros(least, np.linspace(1.0, end, 2001))


def critical_ratio() -> float:
    """Smallest lambda / mu for which P'(s) = 0 at some s: the law softens in uniaxial strain."""

    def ratio(s: float) -> float:
        return (s**2 + 1.0) / (log(s) - 1.0)

    return float(minimize_scalar(ratio, bounds=(3.0, 20.0), options={"xatol": 1e-10}).fun)


def _zeros(function: Callable[[float], float], at: Array) -> list[float]:
    return [
        float(brentq(function, low, high, xtol=1e-12))
        for low, high in pairwise(at.tolist())
        if function(low) * function(high) < 0.0
    ]
