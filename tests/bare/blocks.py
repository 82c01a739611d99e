"""Blocks of the plane: squeezed between walls, and Cook's tapered membrane."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import cosh, pi, sinh

import numpy as np

from tests.bare.reading import at, zigzag
from tests.bare.scene import Bare, at_rest, body, elastic

# Cook's membrane of E = 1 MPa in millimetres, sheared by 12.5 kPa on its right edge; u_y [m] in
# the middle of that edge, by Poisson's ratio. Meshes of 16 and of 32 cells a side differ by 0.03 %.
COOK: Mapping[float, float] = {0.3: 4.103e-3, 0.49: 3.5725e-3, 0.4999: 3.5344e-3}
COOK_MODULUS, COOK_SHEAR, COOK_SIZE = 1e6, 12.5e3, 1e-3  # [Pa], [Pa], [m]


def _cook(nu: float, across: int) -> Mapping[str, float]:
    """`across` particles half way along, where it is 30 mm high."""
    corners = COOK_SIZE * np.array([[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]])
    shape = {"type": "polygon", "vertices": corners.tolist()}
    rest = at_rest(
        body(
            shape,
            30.0 * COOK_SIZE / (across - 1),
            elastic("neo-hookean", COOK_MODULUS, nu, 1000.0),
        )
        .boundary("clamp", where="edge-3")
        .boundary("traction", where="edge-1", traction={"y": COOK_SHEAR})
    )
    end = at(rest, rest.u, COOK_SIZE * np.array([[48.0, 52.0]]))[0, 1]
    return {"end": end / COOK[nu] - 1.0, "zigzag": zigzag(rest, rest.pressure)}


def squeezed(nu: float, E: float, p: float) -> tuple[float, float]:
    """Exact dip [m] and difference of pressure half way [Pa] of the squeezed block.

    Airy's function cos kX (A cosh kY + B kY sinh kY) with k = pi, beside a uniform state, of which
    there is nothing in what the two sides differ by.
    """
    k, mu = pi, 0.5 * E / (1.0 + nu)
    B = -0.5 * p * sinh(k) / (k**2 * (k + sinh(k) * cosh(k)))
    A = -B * (1.0 + k * cosh(k) / sinh(k))
    dip = -k / mu * (A * sinh(k) + B * (k * cosh(k) - sinh(k)) + 2.0 * nu * B * sinh(k))
    return dip, -2.0 * k**2 * B * cosh(0.5 * k)


def _squeezed(nu: float, across: int) -> Mapping[str, float]:
    """A square metre between three smooth walls, squeezed by p (1 + cos pi X) / 2 from above."""
    E, p = 1.0, 1e-5
    shape = {"type": "box", "lengths": [1.0, 1.0]}
    builder = body(shape, 1.0 / (across - 1), elastic("linear-elastic", E, nu))
    for axis, place in (("x", 0.0), ("x", 1.0), ("y", 0.0)):
        builder = builder.boundary("symmetry", axis=axis, at=place)
    load = {"y": f"{-0.5 * p!r}*(1 + cos(pi*X))"}
    rest = at_rest(builder.boundary("traction", where="top", traction=load))
    dip, half_way = squeezed(nu, E, p)
    places = np.array([[0.0, 1.0], [1.0, 1.0], [0.0, 0.5], [1.0, 0.5]])
    u, pressure = at(rest, rest.u, places), at(rest, rest.pressure, places)
    return {
        "dip": (u[0, 1] - u[1, 1]) / dip - 1.0,
        "pressure half way": (pressure[2] - pressure[3]) / half_way - 1.0,
        "zigzag": zigzag(rest, rest.pressure),
    }


_SMOOTH = {8: 0.03, 15: 0.03, 29: 0.03}

BLOCKS = (
    *(
        Bare(
            f"squeezed-block-{nu:g}",
            "Airy's stress function",
            partial(_squeezed, nu),
            {"dip": {8: 0.02}, "pressure half way": {15: 0.02}, "zigzag": _SMOOTH},
            (8, 15, 29),
            unordered=("zigzag",),
        )
        for nu in (0.3, 0.49, 0.4999)
    ),
    *(
        Bare(
            f"cook-{nu:g}",
            "finite elements (tests/bare/references.py)",
            partial(_cook, nu),
            {"end": {16: 0.015}},
            (8, 16, 32),
            floor=5e-4,
        )
        for nu in COOK
    ),
)
