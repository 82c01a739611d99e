"""An eighth of a ball, full or hollow: pressed, under its own weight, breathing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import cos, factorial, pi, prod, sin, sqrt
from typing import Any, final

import attrs
import numpy as np
from scipy.optimize import brentq

from solidsph.maths.arrays import Array
from tests.bare.reading import at, period_of
from tests.bare.rings import with_symmetry
from tests.bare.scene import Bare, Fields, at_rest, body, elastic, histories

E, NU = 1.0, 0.3
LAMBDA, MU = E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), 0.5 * E / (1.0 + NU)
M = LAMBDA + 2.0 * MU

# Directions within the eighth, one of each kind: on its edges, on its planes, inside.
_RAYS = np.array(
    [[0, 0, 1], [1, 0, 0], [0, 1, 1], [1, 1, 0], [1, 1, 1], [1, 2, 4], [3, 1, 1]], float
)
RAYS: Array = _RAYS / np.linalg.norm(_RAYS, axis=1, keepdims=True)


def eighth(radius: float, hollow: float | None = None) -> Mapping[str, Any]:
    """A ball where X, Y and Z are positive; `hollow` is the radius of what it lacks inside."""
    r, side = 1.5 * radius, 3.0 * radius
    cuts: list[Mapping[str, Any]] = [
        {
            "type": "box",
            "lengths": [r if one == axis else side for one in range(3)],
            "origin": [-r] * 3,
        }
        for axis in range(3)
    ]
    inside = [] if hollow is None else [{"type": "ball", "radius": hollow}]
    return {"type": "difference", "of": {"type": "ball", "radius": radius}, "minus": inside + cuts}


def along_rays(fields: Fields, radius: float) -> tuple[Array, Array, Array]:
    """Displacement [m], radial and hoop stress [Pa] at a radius along each ray."""
    u = np.einsum("ki,ki->k", RAYS, at(fields, fields.u, radius * RAYS))
    sigma = at(fields, fields.sigma, radius * RAYS)
    radial = np.einsum("ki,kij,kj->k", RAYS, sigma, RAYS)
    return u, radial, 0.5 * (np.trace(sigma, axis1=1, axis2=2) - radial)


def _worst(found: Array, exact: float, scale: float | None = None) -> float:
    return float(np.abs(found - exact).max() / abs(exact if scale is None else scale))


def _pressed(across: int) -> Mapping[str, float]:
    """A full ball under pressure: uniform, u = -p r (1 - 2 nu) / E. The planes bear it as well."""
    p = 1e-5
    builder = body(eighth(1.0), 1.0 / (across - 1), elastic("linear-elastic", E, NU))
    rest = at_rest(with_symmetry(builder.boundary("pressure", where="surface", pressure=p), "xyz"))
    u, radial, hoop = along_rays(rest, 1.0)
    return {
        "shrinkage": _worst(u, -p * (1.0 - 2.0 * NU) / E),
        "stress": max(_worst(radial, -p), _worst(hoop, -p)),
    }


@final
@attrs.frozen
class Ball:
    """An exact solution of a ball, of small strains."""

    growth: Callable[[float], float]  # radial displacement by radius [m]
    radial: Callable[[float], float]  # stress [Pa]
    hoop: Callable[[float], float]  # [Pa]


def hollow_ball(p: float, a: float, b: float) -> Ball:
    """A thick shell under a pressure p inside (Lamé): sigma_r = A (1 - (b / r)^3)."""
    A = p / ((b / a) ** 3 - 1.0)

    def radial(r: float) -> float:
        return A * (1.0 - (b / r) ** 3)

    def hoop(r: float) -> float:
        return A * (1.0 + 0.5 * (b / r) ** 3)

    return Ball(lambda r: r / E * ((1.0 - NU) * hoop(r) - NU * radial(r)), radial, hoop)


def heavy_ball(g: float) -> Ball:
    """A ball of radius 1 pulled to its middle by g r (Love 1927, section 98).

    M (r^-2 (r^2 u)')' = g r gives u = k r (r^2 - (3 M + 2 lambda) / (M + 2 lambda)) with
    k = g / (10 M) and no stress on the surface.
    """
    k, c = 0.1 * g / M, (3.0 * M + 2.0 * LAMBDA) / (M + 2.0 * LAMBDA)
    volume = 3.0 * LAMBDA + 2.0 * MU
    return Ball(
        lambda r: k * r * (r**2 - c),
        lambda r: k * ((3.0 * M + 2.0 * LAMBDA) * r**2 - volume * c),
        lambda r: k * ((5.0 * LAMBDA + 2.0 * MU) * r**2 - volume * c),
    )


def _hollow(across: int) -> Mapping[str, float]:
    p, a, b = 1e-5, 1.0, 2.0
    builder = body(eighth(b, a), (b - a) / (across - 1), elastic("linear-elastic", E, NU))
    builder = builder.boundary("pressure", where="hole-surface", pressure=p)
    rest, exact = at_rest(with_symmetry(builder, "xyz")), hollow_ball(p, a, b)
    read = {r: along_rays(rest, r) for r in (a, b)}
    return {
        "growth of the hole": _worst(read[a][0], exact.growth(a)),
        "radial stress": max(_worst(read[r][1], exact.radial(r), p) for r in (a, b)),
        "hoop stress": max(_worst(read[r][2], exact.hoop(r), exact.hoop(a)) for r in (a, b)),
    }


def _own_weight(across: int) -> Mapping[str, float]:
    g = 1e-5
    pull = {axis: f"{-g!r}*{axis.upper()}" for axis in "xyz"}
    builder = body(eighth(1.0), 1.0 / (across - 1), elastic("linear-elastic", E, NU))
    rest = at_rest(with_symmetry(builder.effect("body-force", acceleration=pull), "xyz"))
    exact = heavy_ball(g)
    return {
        "shrinkage": _worst(along_rays(rest, 1.0)[0], exact.growth(1.0)),
        "pressure in the middle": _worst(
            at(rest, rest.pressure, np.zeros((1, 3))), -exact.radial(0.0)
        ),
    }


def breathing_root() -> float:
    """First root of tan x / x = 1 / (1 - x^2 M / (4 mu)) (Lamb 1882): x = omega R / c_p."""
    return float(brentq(lambda x: sin(x) * (1.0 - x**2 * M / (4.0 * MU)) - x * cos(x), 2.0, 3.0))


def _breathing(across: int) -> Mapping[str, float]:
    """Its first radial mode, u = j1(k r), as a series of j1(y) / y in y^2."""
    k = breathing_root()
    terms = [
        (-1.0) ** n * k ** (2 * n) / (2**n * factorial(n) * prod(range(1, 2 * n + 4, 2)))
        for n in range(8)
    ]
    series = " + ".join(f"{term!r}*(X*X + Y*Y + Z*Z)**{n}" for n, term in enumerate(terms))
    velocity = {axis: f"1e-4*{axis.upper()}*({series})" for axis in "xyz"}
    period = 2.0 * pi / (k * sqrt(M))
    times, values = histories(
        with_symmetry(
            body(eighth(1.0), 1.0 / (across - 1), elastic("linear-elastic", E, NU)), "xyz"
        ).initial(velocity=velocity),
        *(0.6 * period, 40, lambda fields: float(np.sum(fields.u * fields.places))),
    )
    return {"frequency": period / period_of(times, values, period) - 1.0}


BALLS = (
    Bare(
        "pressed-ball",
        "uniform pressure",
        _pressed,
        {"shrinkage": {8: 0.02}, "stress": {8: 0.02}},
        (5, 8, 12),
    ),
    Bare(
        "hollow-ball",
        "Lamé",
        _hollow,
        {"growth of the hole": {9: 0.02}, "radial stress": {9: 0.05}, "hoop stress": {9: 0.02}},
        (5, 7, 9),
    ),
    Bare(
        "heavy-ball",
        "Love (1927), Mathematical Theory of Elasticity, section 98",
        _own_weight,
        {"shrinkage": {8: 0.02}, "pressure in the middle": {8: 0.02}},
        (5, 8, 12),
    ),
    Bare("breathing-ball", "Lamb (1882)", _breathing, {"frequency": {8: 0.02}}, (5, 8, 12)),
)
