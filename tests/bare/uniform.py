"""Uniform strains and linear stresses, which are to come out exactly at every particle."""

from __future__ import annotations

from collections.abc import Mapping
from math import log
from typing import Any

import numpy as np
from scipy.optimize import fsolve
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array
from tests.bare.reading import at
from tests.bare.scene import Bare, Fields, at_rest, body, elastic

# An irregular region of the plane, convex but for one corner.
CORNERS = ((0.0, 0.0), (1.1, -0.15), (1.35, 0.6), (0.75, 0.65), (0.6, 1.2), (-0.1, 0.7))
POLYGON: Mapping[str, Any] = {"type": "polygon", "vertices": [list(point) for point in CORNERS]}


def neighbour_error(rest: Fields, gradient: Array) -> float:
    """Largest error of what neighbours move against each other, over the largest of that.

    Args:
        gradient: of the exact displacement, which is linear, (d, d).
    """
    pairs = cKDTree(rest.places).query_pairs(1.5 * rest.spacing, output_type="ndarray")
    apart = rest.places[pairs[:, 0]] - rest.places[pairs[:, 1]]
    exact = apart @ gradient.T
    found = rest.u[pairs[:, 0]] - rest.u[pairs[:, 1]]
    return float(np.abs(found - exact).max() / np.abs(exact).max())


def _kinematic_patch(across: int) -> Mapping[str, float]:
    """An irregular body whose surface is moved linearly: so moves its inside."""
    H = 1e-4 * np.array([[1.0, 0.4], [-0.2, -0.7]])
    rest = at_rest(
        body(POLYGON, 1.0 / (across - 1), elastic("linear-elastic", 1.0, 0.3)).boundary(
            "prescribed-motion", where="surface", displacement=linear_motion(H)
        )
    )
    return {"neighbours": neighbour_error(rest, H)}


def _traction_patch(across: int) -> Mapping[str, float]:
    """The same body under one stress: its traction on every edge but one, which is moved."""
    # So small that the Cauchy stress is the nominal one.
    E, nu, S = 1.0, 0.3, 1e-6
    stress = S * np.array([[1.0, 0.3], [0.3, -0.5]])
    mu = 0.5 * E / (1.0 + nu)
    strain = (stress - nu * np.trace(stress) * np.eye(2)) / (2.0 * mu)
    builder = body(POLYGON, 1.0 / (across - 1), elastic("linear-elastic", E, nu))
    edges = (np.roll(np.array(CORNERS), -1, axis=0) - np.array(CORNERS))[:-1]
    for i, edge in enumerate(edges):
        x, y = (stress @ [edge[1], -edge[0]] / np.hypot(*edge)).tolist()
        builder = builder.boundary("traction", where=f"edge-{i}", traction={"x": x, "y": y})
    rest = at_rest(
        builder.boundary(
            "prescribed-motion", where=f"edge-{len(edges)}", displacement=linear_motion(strain)
        )
    )
    return {
        "neighbours": neighbour_error(rest, strain),
        "stress": float(np.abs(rest.sigma - stress).max() / np.abs(stress).max()),
    }


def linear_motion(H: Array) -> Mapping[str, str]:
    """u = H X in the words of a scene, in the plane."""
    return {axis: f"{a!r}*X + {b!r}*Y" for axis, (a, b) in zip("xy", H.tolist(), strict=True)}


def _pulled(dimension: int, kernel: str | None, across: int) -> Mapping[str, float]:
    """A bar of rubber pulled at its end by a tenth of its modulus, free across."""
    E, nu, pull = 1e6, 0.3, 1e5
    shape = (
        {"type": "interval", "length": 1.0}
        if dimension == 1
        else {"type": "box", "lengths": [1.0, 0.5, 0.5][:dimension]}
    )
    spacing = (1.0 if dimension == 1 else 0.5) / (across - 1)
    builder = body(shape, spacing, elastic("neo-hookean", E, nu)).boundary(
        "traction", where="right", traction={"x": pull}
    )
    if kernel is not None:
        builder = builder.kernel(kernel)
    if dimension == 1:
        builder = builder.boundary("clamp", where="left")
    for axis in "xyz"[:dimension] if dimension > 1 else "":
        builder = builder.boundary("symmetry", axis=axis)
    return {
        "neighbours": neighbour_error(at_rest(builder), pulled_gradient(E, nu, pull, dimension))
    }


def pulled_gradient(E: float, nu: float, pull: float, dimension: int) -> Array:
    """Displacement gradient of the uniform stretch under a nominal stress along x, (d, d).

    P = mu (s - 1/s) + lambda ln J / s along each axis, with the stretches that are not there 1.
    """
    lam, mu = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * E / (1.0 + nu)

    def miss(s: Array) -> list[float]:
        stretches = [s[0], *[s[-1]] * (dimension - 1)]
        ln_J = log(np.prod(stretches))
        wanted = [pull, 0.0]
        return [
            (mu * (one - 1.0 / one) + lam * ln_J / one - want) / mu
            for one, want in zip(s, wanted, strict=False)
        ]

    s = fsolve(miss, [1.05] if dimension == 1 else [1.05, 0.98], xtol=1e-13)
    return np.diag([s[0], *[s[-1]] * (dimension - 1)]) - np.eye(dimension)


def _hanging_bar(across: int) -> Mapping[str, float]:
    """A bar in the plane that hangs from its upper edge by its weight; Timoshenko & Goodier, 102.

    sigma_yy = g y from the free end at y = 0, and nothing else.
    """
    E, nu, g, L = 1.0, 0.3, 1e-5, 2.0
    stiffness, ratio = E / (1.0 - nu**2), nu / (1.0 - nu)
    shape = {"type": "box", "lengths": [1.0, L], "origin": [-0.5, 0.0]}
    c = g / (2.0 * stiffness)
    top = {"x": f"{-2.0 * c * ratio * L!r}*X", "y": f"{c * ratio!r}*X*X"}
    rest = at_rest(
        body(shape, 1.0 / (across - 1), elastic("linear-elastic", E, nu))
        .boundary("prescribed-motion", where="top", displacement=top)
        .effect("body-force", acceleration={"y": -g})
    )
    X, Y = rest.places.T
    exact = np.stack([-2.0 * c * ratio * X * Y, c * (Y**2 - L**2 + ratio * X**2)], axis=1)
    middle = at(rest, rest.sigma, np.array([[0.0, 0.5 * L]]))[0, 1, 1]
    return {
        "displacement": float(np.abs(rest.u - exact).max() / np.abs(exact).max()),
        "stress half way": middle / (0.5 * g * L) - 1.0,
    }


# Newton's method leaves 1e-9 of the loads, which is more of what neighbours move, the finer.
_EXACT = 1e-5

_LAW = "the law in closed form"


def _bar_scenes() -> tuple[Bare, ...]:
    scenes = []
    for dimension, across in ((1, (11, 21, 41)), (2, (5, 9, 17)), (3, (4, 6, 8))):
        for kernel in (None, "cubic-spline"):
            name = f"pulled-bar-{dimension}d" + ("" if kernel is None else f"-{kernel}")
            scenes.append(
                Bare(
                    name,
                    _LAW,
                    lambda n, d=dimension, k=kernel: _pulled(d, k, n),
                    {"neighbours": dict.fromkeys(across, _EXACT)},
                    across,
                    floor=_EXACT,
                )
            )
    return tuple(scenes)


UNIFORM = (
    Bare(
        "kinematic-patch",
        "linear displacements",
        _kinematic_patch,
        {"neighbours": dict.fromkeys((6, 11, 21), _EXACT)},
        (6, 11, 21),
        floor=_EXACT,
    ),
    Bare(
        "traction-patch",
        "Hooke's law",
        _traction_patch,
        {
            "stress": dict.fromkeys((6, 11, 21), _EXACT),
            "neighbours": dict.fromkeys((6, 11, 21), _EXACT),
        },
        (6, 11, 21),
        floor=_EXACT,
    ),
    *_bar_scenes(),
    Bare(
        "hanging-bar",
        "Timoshenko & Goodier, Theory of Elasticity, section 102",
        _hanging_bar,
        {"displacement": {6: 0.01}, "stress half way": {6: 0.01}},
        (6, 11, 21),
    ),
)
