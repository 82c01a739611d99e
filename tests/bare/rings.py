"""Rings and discs of the plane: under pressure, inflated, spinning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any, final

import attrs
import numpy as np
from scipy.integrate import solve_bvp

from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from tests.bare.reading import at, zigzag
from tests.bare.scene import Bare, Fields, at_rest, body, elastic

INNER, OUTER = 1.0, 2.0  # radii [m]
E, NU = 1.0, 0.3
RING: Mapping[str, Any] = {"type": "annulus", "inner_radius": INNER, "outer_radius": OUTER}


def first_quadrant(shape: Mapping[str, Any], radius: float) -> Mapping[str, Any]:
    """The part of a shape where X and Y are positive, by two boxes taken away."""
    r, side = radius, 2.0 * radius
    return {
        "type": "difference",
        "of": shape,
        "minus": [
            {"type": "box", "lengths": [r, side], "origin": [-r, -r]},
            {"type": "box", "lengths": [side, r], "origin": [-r, -r]},
        ],
    }


def with_symmetry(builder: SceneBuilder, axes: str = "xy") -> SceneBuilder:
    """`builder` with planes of symmetry through the origin."""
    for axis in axes:
        builder = builder.boundary("symmetry", axis=axis)
    return builder


def growth(rest: Fields, radius: float) -> float:
    """Mean radial displacement around a quarter of a circle [m]."""
    outward = _directions()
    read = at(rest, rest.u, radius * outward)
    return float(np.einsum("ki,ki->k", outward, read).mean())


def _directions() -> Array:
    angles = np.linspace(0.0, 0.5 * np.pi, 13)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


@final
@attrs.frozen
class Ring:
    """An exact solution of a ring in plane strain, of small strains."""

    radial: Callable[[float], float]  # stress by radius [Pa]
    hoop: Callable[[float], float]  # [Pa]

    def growth(self, r: float) -> float:
        """Radial displacement: the radius times the hoop strain [m]."""
        return r * (1.0 + NU) / E * ((1.0 - NU) * self.hoop(r) - NU * self.radial(r))

    def errors(self, fields: Fields) -> Mapping[str, float]:
        """Largest errors of the stresses over their largest values, inside, half way and outside.

        The worst of 13 places around a quarter of each circle.
        """
        outward, errors = _directions(), {}
        for name, exact, along in (
            ("radial", self.radial, outward),
            ("hoop", self.hoop, outward[:, ::-1] * [-1.0, 1.0]),
        ):
            misses, values = [], []
            for r in (INNER, 0.5 * (INNER + OUTER), OUTER):
                read = at(fields, fields.sigma, r * outward)
                found = np.einsum("ki,kij,kj->k", along, read, along)
                misses.append(np.abs(found - exact(r)).max())
                values.append(abs(exact(r)))
            errors[f"{name} stress"] = float(max(misses) / max(values))
        return errors


def pressed_ring(p: float) -> Ring:
    """A pressure p inside (Lamé): A (1 -+ b^2 / r^2) with A = p a^2 / (b^2 - a^2)."""
    A = p * INNER**2 / (OUTER**2 - INNER**2)
    return Ring(lambda r: A * (1.0 - OUTER**2 / r**2), lambda r: A * (1.0 + OUTER**2 / r**2))


def spinning_ring(pull: float) -> Ring:
    """Spinning with rho omega^2 = `pull` [N/m^4]: Timoshenko & Goodier, section 32."""
    C = pull * (3.0 - 2.0 * NU) / (8.0 * (1.0 - NU))
    flat = (1.0 + 2.0 * NU) / (3.0 - 2.0 * NU)
    ends, both = INNER**2 + OUTER**2, (INNER * OUTER) ** 2
    return Ring(
        lambda r: C * (ends - both / r**2 - r**2), lambda r: C * (ends + both / r**2 - flat * r**2)
    )


def _lame(whole: bool, across: int) -> Mapping[str, float]:
    spacing, p = (OUTER - INNER) / (across - 1), 1e-5
    shape = RING if whole else first_quadrant(RING, 1.5 * OUTER)
    builder = body(shape, spacing, elastic("linear-elastic", E, NU))
    builder = builder.boundary("pressure", where="inner", pressure=p)
    if whole:
        # Where the outer edge crosses an axis, it does not move along the edge.
        near = 0.6 * spacing
        for cross, along in (("X", "Y"), ("Y", "X")):
            where = f"abs({cross}) < {near!r} and abs({along}) > {OUTER - near!r}"
            builder = builder.boundary("clamp", where=where, axes=[cross.lower()])
    else:
        builder = with_symmetry(builder)
    rest, exact = at_rest(builder), pressed_ring(p)
    return {
        **exact.errors(rest),
        "growth of the hole": growth(rest, INNER) / exact.growth(INNER) - 1.0,
    }


def _spinning(across: int) -> Mapping[str, float]:
    pull, shape = 1e-5, first_quadrant(RING, 1.5 * OUTER)
    acceleration = {"x": f"{pull!r}*X", "y": f"{pull!r}*Y"}
    builder = body(shape, (OUTER - INNER) / (across - 1), elastic("linear-elastic", E, NU))
    rest = at_rest(with_symmetry(builder.effect("body-force", acceleration=acceleration)))
    exact = spinning_ring(pull)
    return {
        **exact.errors(rest),
        "growth of the rim": growth(rest, OUTER) / exact.growth(OUTER) - 1.0,
    }


@cache
def inflated(modulus: float, nu: float, pressure: float) -> tuple[float, float]:
    """Growth of the inner and of the outer radius of a ring of rubber inflated by a pressure [m].

    Equilibrium dP_r / dR = (P_t - P_r) / R with P = mu (s - 1/s) + lambda ln J / s in each of the
    stretches r' and r / R, as a boundary value problem; P_r = -p r / R at the inner edge.
    """
    lam, mu = modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * modulus / (1.0 + nu)

    def nominal(own: Array, other: Array) -> Array:
        return np.asarray(mu * (own - 1.0 / own) + lam * np.log(own * other) / own)

    def slopes(R: Array, y: Array) -> Array:
        r, g = y
        h = r / R
        radial, hoop = nominal(g, h), nominal(h, g)
        of_own = mu * (1.0 + 1.0 / g**2) + lam * (1.0 - np.log(g * h)) / g**2
        of_other = lam / (g * h)
        change_of_h = (g - h) / R
        return np.array([g, ((hoop - radial) / R - of_other * change_of_h) / of_own])

    def ends(p: float, inner: Array, outer: Array) -> Array:
        h = inner[0] / INNER
        pushed, free = nominal(inner[1], h) + p * h, nominal(outer[1], outer[0] / OUTER)
        return np.array([pushed, free]) / mu

    R = np.linspace(INNER, OUTER, 41)
    guess = np.array([R, np.ones_like(R)])
    for p in pressure * np.array([0.25, 0.5, 0.75, 1.0]):
        found = solve_bvp(slopes, partial(ends, p), R, guess, tol=1e-9, max_nodes=20000)
        assert found.success, found.message
        guess = found.sol(R)
    r = found.sol(np.array([INNER, OUTER]))[0]
    return float(r[0] - INNER), float(r[1] - OUTER)


def _inflated(nu: float, across: int) -> Mapping[str, float]:
    modulus, p = 1e6, 2e5
    builder = body(
        first_quadrant(RING, 1.5 * OUTER),
        (OUTER - INNER) / (across - 1),
        elastic("neo-hookean", modulus, nu, 1000.0),
    )
    rest = at_rest(with_symmetry(builder.boundary("pressure", where="inner", pressure=p)))
    inner, outer = inflated(modulus, nu, p)
    return {
        "growth of the hole": growth(rest, INNER) / inner - 1.0,
        "growth of the rim": growth(rest, OUTER) / outer - 1.0,
        "zigzag": zigzag(rest, rest.pressure),
    }


_STRESSES = {"radial stress": {8: 0.02}, "hoop stress": {8: 0.02}}

RINGS = (
    Bare(
        "lame-ring",
        "Lamé",
        lambda n: _lame(False, n),
        {**_STRESSES, "growth of the hole": {8: 0.01}},
        (5, 8, 15),
    ),
    Bare(
        "lame-ring-whole",
        "Lamé",
        lambda n: _lame(True, n),
        {**_STRESSES, "growth of the hole": {8: 0.01}},
        (5, 8, 15),
    ),
    Bare(
        "spinning-ring",
        "Timoshenko & Goodier, Theory of Elasticity, section 32, in plane strain",
        _spinning,
        {"hoop stress": {8: 0.02}, "growth of the rim": {8: 0.01}},
        (5, 8, 15),
    ),
    *(
        Bare(
            f"inflated-ring-{nu:g}",
            "the same law as a boundary value problem of the radius",
            lambda n, nu=nu: _inflated(nu, n),
            {
                "growth of the hole": {8: 0.01},
                "growth of the rim": {8: 0.01},
                "zigzag": {8: 0.03, 15: 0.03},
            },
            (5, 8, 15),
            unordered=("zigzag",),
        )
        for nu in (0.3, 0.4999)
    ),
)
