"""A square sheet with a round hole: pulled until it is rubber, and in Kirsch's own field."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tests.bare.reading import at, mean_on, zigzag
from tests.bare.rings import with_symmetry
from tests.bare.scene import Bare, at_rest, body, elastic

HOLE = 0.2  # radius over half the side of the sheet, which is 1 m
SOURCE = "finite elements (tests/bare/references.py)"

# By Poisson's ratio: mean u_x of the pulled edge [m], largest principal Cauchy stress at the hole
# [Pa]. Of E = 70 MPa under 5 MPa; the last digit is uncertain by one.
SHEETS: Mapping[float, tuple[float, float]] = {
    0.3: (0.075752, 15.81e6),
    0.49: (0.065058, 16.74e6),
}


def with_hole(square: Mapping[str, Any]) -> Mapping[str, Any]:
    """A square without the disc around the origin."""
    return {"type": "difference", "of": square, "minus": {"type": "disc", "radius": HOLE}}


QUARTER = with_hole({"type": "box", "lengths": [1.0, 1.0]})
WHOLE = with_hole({"type": "box", "lengths": [2.0, 2.0], "origin": [-1.0, -1.0]})


def sheet(nu: float, whole: bool, across: int) -> Mapping[str, float]:
    """`across` spacings from the middle to an edge."""
    builder = body(
        WHOLE if whole else QUARTER, 1.0 / across, elastic("neo-hookean", 70e6, nu, 1000.0)
    ).boundary("traction", where="right", traction={"x": 5e6})
    if whole:
        builder = builder.boundary("traction", where="left", traction={"x": -5e6})
    rest = at_rest(with_symmetry(builder))
    lowest = -1.0 if whole else 0.0
    extension = mean_on(rest, rest.u, np.array([1.0, lowest]), np.array([1.0, 1.0]))[0]
    peak = np.linalg.eigvalsh(at(rest, rest.sigma, np.array([[0.0, HOLE]]))[0])[-1]
    known = SHEETS[nu]
    return {
        "extension": extension / known[0] - 1.0,
        "peak stress": peak / known[1] - 1.0,
        "zigzag": zigzag(rest, rest.pressure),
    }


def kirsch(S: float) -> tuple[str, str, str]:
    """sigma_xx, sigma_yy and sigma_xy around a hole in an infinite sheet pulled by S along x."""
    a2, c, s = f"({HOLE**2!r}/(X*X + Y*Y))", "((X*X - Y*Y)/(X*X + Y*Y))", "(2*X*Y/(X*X + Y*Y))"
    c4, s4 = f"({c}**2 - {s}**2)", f"(2*{c}*{s})"  # of 4 t, as those are of 2 t
    return (
        f"{S!r}*(1 - {a2}*(1.5*{c} + {c4}) + 1.5*{a2}**2*{c4})",
        f"{S!r}*(-{a2}*(0.5*{c} - {c4}) - 1.5*{a2}**2*{c4})",
        f"{S!r}*(-{a2}*(0.5*{s} + {s4}) + 1.5*{a2}**2*{s4})",
    )


def kirsch_opening(nu: float, E: float, S: float) -> tuple[float, float]:
    """u_x of the hole at (a, 0) and u_y at (0, a) in plane strain, from its hoop strain [m]."""
    scale = (1.0 - nu**2) / E * S * HOLE
    return 3.0 * scale, -scale


def _kirsch(across: int) -> Mapping[str, float]:
    """A quarter of a small sheet, with the tractions that an infinite one has there."""
    E, nu, S = 1.0, 0.3, 1e-5
    xx, yy, xy = kirsch(S)
    rest = at_rest(
        with_symmetry(
            body(QUARTER, 1.0 / across, elastic("linear-elastic", E, nu))
            .boundary("traction", where="right", traction={"x": xx, "y": xy})
            .boundary("traction", where="top", traction={"x": xy, "y": yy})
        )
    )
    places = np.array([[HOLE, 0.0], [0.0, HOLE]])
    u, sigma = at(rest, rest.u, places), at(rest, rest.sigma, places)
    opening, closing = kirsch_opening(nu, E, S)
    return {
        "peak stress": sigma[1, 0, 0] / (3.0 * S) - 1.0,
        "opening": u[0, 0] / opening - 1.0,
        "closing": u[1, 1] / closing - 1.0,
    }


HOLES = (
    *(
        Bare(
            f"sheet-{nu:g}-{'whole' if whole else 'quarter'}",
            SOURCE,
            lambda n, nu=nu, whole=whole: sheet(nu, whole, n),
            {
                "extension": {20: 0.005},
                "peak stress": {20: 0.05, 40: 0.03},
                **({"zigzag": {20: 0.03, 40: 0.03}} if nu == 0.49 else {}),
            },
            (10, 20, 40),
            unordered=("zigzag",),
        )
        for nu in SHEETS
        for whole in (False, True)
    ),
    Bare(
        "kirsch",
        "Kirsch (1898)",
        _kirsch,
        {"peak stress": {20: 0.05, 40: 0.03}, "opening": {20: 0.02}},
        (10, 20, 40),
    ),
)
