"""Bars of square and of round cross-section that are twisted, at rest and swinging."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, sqrt
from typing import Any

import numpy as np

from tests.bare.reading import period_of
from tests.bare.scene import Bare, Fields, at_rest, body, elastic, histories

SAINT_VENANT = "Saint-Venant; Timoshenko & Goodier, Theory of Elasticity, section 109"

# Torsion constant of a square of side a over a^4, and the warping constant over a^6.
SQUARE = 0.140577
WARPING = 1.34e-4

E, NU, SIDE = 2.6, 0.3, 1.0  # so that G = 1


def _square(length: float) -> Mapping[str, Any]:
    half = 0.5 * SIDE
    return {"type": "box", "lengths": [SIDE, SIDE, length], "origin": [-half, -half, 0.0]}


def _torque(
    shape: Mapping[str, Any], faces: tuple[str, str], length: float, spacing: float, twist: float
) -> float:
    """Moment about z on the second face, which is turned while the first is not; both may warp."""
    angle = twist * length
    turned = {"x": f"{-angle!r}*Y", "y": f"{angle!r}*X"}
    rest = at_rest(
        body(shape, spacing, elastic("linear-elastic", E, NU))
        .boundary("clamp", where=faces[0], axes=["x", "y"])
        .boundary("prescribed-motion", where=faces[1], displacement=turned, label="head")
        # Nothing else holds it along z; there is no warping on the axis.
        .boundary("clamp", where=f"X*X + Y*Y + Z*Z < {(0.9 * spacing) ** 2!r}", axes=["z"])
    )
    # What the face is held by is in its account.
    force, (X, Y, _) = rest.observation.state.applied["head"], rest.places.T
    return float(np.sum(X * force[:, 1] - Y * force[:, 0]))


def _square_bar(across: int) -> Mapping[str, float]:
    """Any length is right, since both ends warp as the rest does."""
    twist, length, spacing = 1e-4, 1.0, SIDE / (across - 1)
    torque = _torque(_square(length), ("front", "back"), length, spacing, twist)
    return {"torque": torque / (SQUARE * SIDE**4 * twist) - 1.0}


def _round_bar(across: int) -> Mapping[str, float]:
    twist, length, radius = 1e-4, 1.0, 0.5
    shape = {"type": "cylinder", "radius": radius, "length": length}
    torque = _torque(shape, ("base", "end"), length, 2.0 * radius / (across - 1), twist)
    return {"torque": torque / (0.5 * pi * radius**4 * twist) - 1.0}


def square_bar_frequency(length: float) -> float:
    """First of a bar that does not turn at one end, where it may warp, and is free at the other.

    With k = pi / (2 L), omega^2 = (G J k^2 + E C k^4) / (rho (I + C k^2)): the warping constant C
    is a correction, of 0.1 % where the bar is twice as long as thick, in which its own ends and
    the motion across the bar are neglected. [Hz]
    """
    k, C, polar = 0.5 * pi / length, WARPING * SIDE**6, SIDE**4 / 6.0
    squared = (SQUARE * SIDE**4 * k**2 + E * C * k**4) / (polar + C * k**2)
    return sqrt(squared) / (2.0 * pi)


def _swinging_bar(across: int) -> Mapping[str, float]:
    """Half a swing after a start at rest, with the velocity of the mode."""
    length, spacing, rate = 2.0, SIDE / (across - 1), 1e-3
    mode = f"{rate!r}*sin(0.5*pi*Z/{length!r})"

    def twist(fields: Fields) -> float:
        X, Y, Z = fields.places.T
        # Those of the mode, each with what it has of it, so that no face is asked.
        shape = np.sin(0.5 * pi * Z / length)[:, None] * np.stack([-Y, X, 0.0 * X], axis=1)
        return float(np.sum(fields.u * shape) / np.sum(shape**2))

    period = 1.0 / square_bar_frequency(length)
    times, values = histories(
        body(_square(length), spacing, elastic("linear-elastic", E, NU))
        .boundary("clamp", where="front", axes=["x", "y"])
        .initial(velocity={"x": f"-Y*{mode}", "y": f"X*{mode}", "z": 0.0}),
        *(0.55 * period, 40, twist),
    )
    return {"frequency": period / period_of(times, values, period) - 1.0}


TORSION = (
    Bare("torsion-square", SAINT_VENANT, _square_bar, {"torque": {8: 0.02}}, (6, 8, 12)),
    Bare(
        "torsion-round",
        "Coulomb (1784)",
        _round_bar,
        {"torque": {8: 0.02}},
        (6, 8, 12),
    ),
    Bare(
        "torsion-frequency",
        f"{SAINT_VENANT}; its warping corrected",
        _swinging_bar,
        {"frequency": {8: 0.02}},
        (6, 8, 12),
        floor=1e-3,
    ),
)
