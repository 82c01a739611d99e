"""Beams in bending: Turek and Hron's at rest, Timoshenko's cantilevers, bent bars."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import log, sqrt
from typing import Any

import numpy as np

from solidsph.maths.formulas import Expression
from solidsph.scene.scene_builder import SceneBuilder
from tests.bare.reading import at, zigzag
from tests.bare.rings import first_quadrant
from tests.bare.scene import Bare, Fields, at_rest, body, elastic

TUREK = "Turek & Hron (2006), section 4.2"
FINITE_ELEMENTS = "quadratic finite elements, refined towards the clamp (tests/cases/test_beam.py)"
LENGTH, HEIGHT, RADIUS = 0.35, 0.02, 0.05  # [m]

# The beam's edges end on the disc that holds it, behind its foremost point at the origin [m].
_CORNER = sqrt(RADIUS**2 - (0.5 * HEIGHT) ** 2) - RADIUS

STRAIGHT: Mapping[str, Any] = {
    "type": "box",
    "lengths": [LENGTH, HEIGHT],
    "origin": [0.0, -0.5 * HEIGHT],
}
ON_ARC: Mapping[str, Any] = {
    "type": "difference",
    "of": {
        "type": "box",
        "lengths": [LENGTH - _CORNER, HEIGHT],
        "origin": [_CORNER, -0.5 * HEIGHT],
    },
    "minus": {"type": "disc", "radius": RADIUS, "centre": [-RADIUS, 0.0]},
}


def turek_hron(shape: Mapping[str, Any], face: str, across: int) -> SceneBuilder:
    """The beam of CSM1 and CSM3 under gravity, held at a face."""
    material = elastic("saint-venant-kirchhoff", 1.4e6, 0.4, 1000.0)
    return (
        body(shape, HEIGHT / (across - 1), material)
        .boundary("clamp", where=face)
        .effect("body-force", acceleration={"y": -2.0})
    )


def _csm1(
    shape: Mapping[str, Any], face: str, reference: float, across: int
) -> Mapping[str, float]:
    rest = at_rest(turek_hron(shape, face, across))
    tip = at(rest, rest.u, np.array([[LENGTH, 0.0]]))[0]
    return {"tip": tip[1] / reference - 1.0}


class Timoshenko:
    """An end-loaded cantilever of unit depth in plane strain, held so that the theory is exact.

    Timoshenko & Goodier, section 21, with the displacements at the root imposed and the parabola of
    shear as a traction on the end.
    """

    E, L, P = 1.0, 5.0, 1e-5  # [Pa], [m], [N/m]: strains of 1e-4

    def __init__(self, poissons_ratio: float) -> None:
        nu = self.nu = poissons_ratio
        self.stiffness, self.ratio = self.E / (1.0 - nu**2), nu / (1.0 - nu)
        self.c = self.P / (6.0 * self.stiffness / 12.0)

    @property
    def tip(self) -> float:
        """u_y of mid-height at the end [m]."""
        return -self.c * ((4.0 + 5.0 * self.ratio) * self.L / 4.0 + 2.0 * self.L**3)

    def scene(self, shape: Mapping[str, Any], across: int) -> SceneBuilder:
        """The cantilever from X = 0 to L, Y from -1/2 to 1/2."""
        c, r, L = self.c, self.ratio, self.L
        material = elastic("linear-elastic", self.E, self.nu)
        root = {"x": f"{c * (2.0 + r)!r}*Y*(Y**2 - 0.25)", "y": f"{-3.0 * c * r * L!r}*Y**2"}
        return (
            body(shape, 1.0 / (across - 1), material)
            .boundary("prescribed-motion", where="left", displacement=root)
            .boundary("traction", where="right", traction={"y": f"{-6.0 * self.P!r}*(0.25 - Y**2)"})
        )

    def errors(self, rest: Fields, *depth: float) -> Mapping[str, float]:
        """Of the tip, and of the bending stress at the upper surface half way."""
        points = np.array([[self.L, 0.0, *depth], [0.5 * self.L, 0.5, *depth]])
        bending = at(rest, rest.sigma, points)[1, 0, 0]
        return {
            "tip": at(rest, rest.u, points)[0, 1] / self.tip - 1.0,
            "bending stress": bending / (self.P * self.L * 3.0) - 1.0,
        }


def _cantilever(poissons_ratio: float, across: int) -> Mapping[str, float]:
    theory = Timoshenko(poissons_ratio)
    shape = {"type": "box", "lengths": [theory.L, 1.0], "origin": [0.0, -0.5]}
    rest = at_rest(theory.scene(shape, across))
    return {**theory.errors(rest), "zigzag": zigzag(rest, rest.pressure)}


def _slab(across: int) -> Mapping[str, float]:
    """The same in space, between planes of symmetry 0.4 m apart."""
    theory, width = Timoshenko(0.3), 0.4
    shape = {"type": "box", "lengths": [theory.L, 1.0, width], "origin": [0.0, -0.5, 0.0]}
    builder = theory.scene(shape, across)
    for height in (0.0, width):
        builder = builder.boundary("symmetry", axis="z", at=height)
    return theory.errors(at_rest(builder), 0.5 * width)


def _bent_bar(across: int) -> Mapping[str, float]:
    """Pure bending in space, with the saddle that Poisson's ratio makes of the cross-section.

    u = k (x y, -(x^2 + nu (y^2 - z^2)) / 2, -nu y z) with sigma_xx = E k y and nothing else.
    """
    nu, k, L = 0.3, 1e-5, 1.0
    shape = {"type": "box", "lengths": [L, 1.0, 1.0], "origin": [0.0, -0.5, -0.5]}
    root = {"x": 0.0, "y": f"{-0.5 * k * nu!r}*(Y**2 - Z**2)", "z": f"{-k * nu!r}*Y*Z"}
    rest = at_rest(
        body(shape, 1.0 / (across - 1), elastic("linear-elastic", 1.0, nu))
        .boundary("prescribed-motion", where="left", displacement=root)
        .boundary("traction", where="right", traction={"x": f"{k!r}*Y"})
    )
    places = np.array([[L, 0.0, 0.0], [L, 0.5, 0.5], [0.5 * L, 0.5, 0.0]])
    u, sigma = at(rest, rest.u, places), at(rest, rest.sigma, places)
    return {
        "tip": u[0, 1] / (-0.5 * k * L**2) - 1.0,
        "saddle": u[1, 2] / (-0.25 * k * nu) - 1.0,
        "bending stress": sigma[2, 0, 0] / (0.5 * k) - 1.0,
    }


def curved_bar_hoop(couple: float, inner: float, outer: float) -> str:
    """Hoop stress of a curved bar straightened by a couple [N], as a formula of its radius Y [m].

    Timoshenko & Goodier, section 29; at X = 0 the radius is Y.
    """
    a, b = inner, outer
    N = (b**2 - a**2) ** 2 - 4.0 * a**2 * b**2 * log(b / a) ** 2
    return (
        f"{-4.0 * couple / N!r}*({-(a**2) * b**2 * log(b / a)!r}/(Y*Y) + {b**2!r}*log(Y/{b!r})"
        f" + {a**2!r}*log({a!r}/Y) + {b**2 - a**2!r})"
    )


def _curved_bar(across: int) -> Mapping[str, float]:
    """A quarter of a ring bent by couples at its ends."""
    a, b, couple = 1.0, 2.0, 1e-5  # inner and outer radius [m], [N]
    ring = {"type": "annulus", "inner_radius": a, "outer_radius": b}
    spacing, hoop = (b - a) / (across - 1), curved_bar_hoop(couple, a, b)
    rest = at_rest(
        body(first_quadrant(ring, 1.5 * b), spacing, elastic("linear-elastic", 1.0, 0.3))
        .boundary("symmetry", axis="y")
        .boundary("clamp", where=f"hypot(X - {a!r}, Y) < {0.8 * spacing!r}", axes=["x"])
        # The right side of the first box that is taken away.
        .boundary("traction", where="right", traction={"x": f"-({hoop})"})
    )
    slant = sqrt(0.5) * np.array([-1.0, 1.0])
    sigma = at(rest, rest.sigma, np.outer([a, b], [sqrt(0.5), sqrt(0.5)]))
    found = np.einsum("i,kij,j->k", slant, sigma, slant)
    exact = Expression.parse(hoop, ("Y",))({"Y": np.array([a, b])})
    return {
        f"hoop stress {side}": float(error)
        for side, error in zip(("inside", "outside"), found / exact - 1.0, strict=True)
    }


_T = "Timoshenko & Goodier, Theory of Elasticity, section"

BEAMS = (
    Bare(
        "csm1",
        TUREK,
        partial(_csm1, ON_ARC, "rim", -66.10e-3),
        {"tip": {5: 0.01, 9: 0.005, 17: 0.003}},
        (5, 9, 17),
    ),
    Bare(
        "csm1-straight",
        FINITE_ELEMENTS,
        partial(_csm1, STRAIGHT, "left", -65.568e-3),
        {"tip": {5: 0.01, 9: 0.005, 17: 0.003}},
        (5, 9, 17),
    ),
    Bare(
        "cantilever",
        f"{_T} 21",
        partial(_cantilever, 0.3),
        {"tip": {6: 0.01}, "bending stress": {6: 0.05}},
        (6, 11, 21),
    ),
    *(
        Bare(
            f"cantilever-{nu:g}",
            f"{_T} 21",
            partial(_cantilever, nu),
            {"tip": {6: 0.01}, "zigzag": {6: 0.03, 11: 0.03, 21: 0.03}},
            (6, 11, 21),
            unordered=("zigzag",),
        )
        for nu in (0.49, 0.4999)
    ),
    Bare("cantilever-3d", f"{_T} 21", _slab, {"tip": {6: 0.01}}, (6, 9, 11)),
    Bare(
        "bent-bar-3d",
        f"{_T} 102",
        _bent_bar,
        {"tip": {6: 0.01}, "saddle": {6: 0.02}, "bending stress": {6: 0.02}},
        (6, 9, 12),
    ),
    Bare(
        "curved-bar",
        f"{_T} 29",
        _curved_bar,
        {"hoop stress inside": {8: 0.03}, "hoop stress outside": {8: 0.03}},
        (5, 8, 15),
    ),
)
