"""Scenes as a user writes them, with closed forms for what their probes measure.

None of them names a part of the scheme. `truth` is by column of the history and reduction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import cos, pi, sin
from typing import final

import attrs

from solidsph import Scene

NU = 0.3


@final
@attrs.frozen
class KnownScene:
    """A scene at any spacing, and the values that its quantities tend to."""

    text: str  # with SPACING in it
    coarse: float  # spacing to begin with [m]
    truth: Mapping[str, float]

    def scene(self, spacing: float) -> Scene:
        return Scene.from_toml(self.text.replace("SPACING", repr(spacing)))


def probe(label: str, quantity: str, *point: float) -> str:
    return f"""
        [[probe]]
        label = "{label}"
        quantity = "{quantity}"
        point = {list(point)}
    """


def elastic(modulus: float = 1.0) -> str:
    return f"""
        [material]
        type = "linear-elastic"
        youngs_modulus = {modulus}
        poissons_ratio = {NU}
        density = 1.0
    """


STATIC = "duration = 1.0\nstatics = {}\n"

QUARTER = """
    [body.ring]
    spacing = SPACING
    [body.ring.shape]
    type = "difference"
    of = {type = "annulus", inner_radius = 1.0, outer_radius = 2.0}
    minus = [
        {type = "box", lengths = [3.0, 6.0], origin = [-3.0, -3.0]},
        {type = "box", lengths = [6.0, 3.0], origin = [-3.0, -3.0]},
    ]
    [[boundary]]
    type = "symmetry"
    axis = "x"
    [[boundary]]
    type = "symmetry"
    axis = "y"
"""

RING_PROBES = (
    probe("inner", "displacement x", 1.0, 0.0)
    + probe("outer", "displacement x", 2.0, 0.0)
    + probe("inner hoop", "stress yy", 1.0, 0.0)
    + probe("middle hoop", "stress yy", 1.5, 0.0)
)


def ring(text: str, radial: Callable[[float], float], hoop: Callable[[float], float]) -> KnownScene:
    def growth(r: float) -> float:
        return r * (1.0 + NU) * ((1.0 - NU) * hoop(r) - NU * radial(r))

    truth = {
        "final inner displacement x [m]": growth(1.0),
        "final outer displacement x [m]": growth(2.0),
        "final inner hoop stress yy [Pa]": hoop(1.0),
        "final middle hoop stress yy [Pa]": hoop(1.5),
    }
    return KnownScene(STATIC + QUARTER + elastic() + text + RING_PROBES, 0.2, truth)


def pressed_ring() -> KnownScene:
    """Lamé's solution."""
    p = 1e-5
    A = p / 3.0
    load = f"""
        [[boundary]]
        type = "pressure"
        where = "inner"
        pressure = {p}
    """
    return ring(load, lambda r: A * (1.0 - 4.0 / r**2), lambda r: A * (1.0 + 4.0 / r**2))


def spinning_ring() -> KnownScene:
    """Timoshenko & Goodier, section 32, in plane strain."""
    pull = 1e-5
    C = pull * (3.0 - 2.0 * NU) / (8.0 * (1.0 - NU))
    flat = (1.0 + 2.0 * NU) / (3.0 - 2.0 * NU)
    load = f"""
        [[effect]]
        type = "body-force"
        acceleration = {{x = "{pull}*X", y = "{pull}*Y"}}
    """
    return ring(
        load,
        lambda r: C * (5.0 - 4.0 / r**2 - r**2),
        lambda r: C * (5.0 + 4.0 / r**2 - flat * r**2),
    )


def hollow_ball() -> KnownScene:
    """Lamé's solution in space."""
    p = 1e-5
    B = p / 7.0

    def growth(r: float) -> float:
        return B * r * ((1.0 - 2.0 * NU) + (1.0 + NU) * 4.0 / r**3)

    text = f"""
        [body.ball]
        spacing = SPACING
        [body.ball.shape]
        type = "difference"
        of = {{type = "ball", radius = 2.0}}
        minus = [
            {{type = "ball", radius = 1.0}},
            {{type = "box", lengths = [3.0, 6.0, 6.0], origin = [-3.0, -3.0, -3.0]}},
            {{type = "box", lengths = [6.0, 3.0, 6.0], origin = [-3.0, -3.0, -3.0]}},
            {{type = "box", lengths = [6.0, 6.0, 3.0], origin = [-3.0, -3.0, -3.0]}},
        ]
        [[boundary]]
        type = "symmetry"
        axis = "x"
        [[boundary]]
        type = "symmetry"
        axis = "y"
        [[boundary]]
        type = "symmetry"
        axis = "z"
        [[boundary]]
        type = "pressure"
        where = "hypot(hypot(X, Y), Z) < 1.01"
        pressure = {p}
    """
    probes = (
        probe("inner", "displacement x", 1.0, 0.0, 0.0)
        + probe("outer", "displacement x", 2.0, 0.0, 0.0)
        + probe("middle hoop", "stress yy", 1.5, 0.0, 0.0)
    )
    truth = {
        "final inner displacement x [m]": growth(1.0),
        "final outer displacement x [m]": growth(2.0),
        "final middle hoop stress yy [Pa]": B * (1.0 + 4.0 / 1.5**3),
    }
    return KnownScene(STATIC + text + elastic() + probes, 0.3, truth)


def waves_of_displacement() -> KnownScene:
    """A square between fixed edges, with the body force that bends it into a sine."""
    A = 1e-4
    lame, shear = NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), 1.0 / (2.0 * (1.0 + NU))
    along, across = A * pi**2 * (lame + 3.0 * shear), -A * pi**2 * (lame + shear)
    text = f"""
        [body.square]
        shape = {{type = "box", lengths = [1.0, 1.0]}}
        spacing = SPACING
        [[boundary]]
        type = "clamp"
        where = "surface"
        [[effect]]
        type = "body-force"
        [effect.acceleration]
        x = "{along}*sin(pi*X)*sin(pi*Y)"
        y = "{across}*cos(pi*X)*cos(pi*Y)"
    """
    probes = (
        probe("centre", "displacement x", 0.5, 0.5)
        + probe("quarter", "stress xx", 0.25, 0.5)
        + probe("below", "stress xy", 0.5, 0.25)
        + probe("edge", "stress xx", 0.0, 0.5)
    )
    stress = (lame + 2.0 * shear) * A * pi
    truth = {
        "final centre displacement x [m]": A,
        "final quarter stress xx [Pa]": stress * cos(0.25 * pi),
        "final below stress xy [Pa]": shear * A * pi * cos(0.25 * pi),
        "final edge stress xx [Pa]": stress,
    }
    return KnownScene(STATIC + text + elastic() + probes, 0.125, truth)


def cantilever() -> KnownScene:
    """Timoshenko's beam of depth 1 and length 4 (Augarde & Deeks 2008), in plane strain."""
    P, L, D = 1e-5, 4.0, 1.0
    E, nu = 1.0 / (1.0 - NU**2), NU / (1.0 - NU)
    II = D**3 / 12.0
    f = P / (6.0 * E * II)
    text = f"""
        [body.beam]
        shape = {{type = "box", lengths = [{L}, {D}], origin = [0.0, {-0.5 * D}]}}
        spacing = SPACING
        [[boundary]]
        type = "prescribed-motion"
        where = "left"
        [boundary.displacement]
        x = "{f * (2.0 + nu)}*Y*(Y**2 - {0.25 * D**2})"
        y = "{-f * 3.0 * nu * L}*Y**2"
        [[boundary]]
        type = "traction"
        where = "right"
        traction = {{y = "{-0.5 * P / II}*({0.25 * D**2} - Y**2)"}}
    """
    probes = (
        probe("tip", "displacement", L, 0.0)
        + probe("fibre", "stress xx", 0.5 * L, 0.5 * D)
        + probe("axis", "stress xy", 0.5 * L, 0.0)
    )
    truth = {
        "final tip displacement x [m]": 0.0,
        "final tip displacement y [m]": -f * ((4.0 + 5.0 * nu) * D**2 * L / 4.0 + 2.0 * L**3),
        "final fibre stress xx [Pa]": P * 0.5 * L * 0.5 * D / II,
        "final axis stress xy [Pa]": -0.5 * P / II * 0.25 * D**2,
    }
    return KnownScene(STATIC + text + elastic() + probes, 0.25, truth)


def ringing_bar() -> KnownScene:
    """The first free vibration of a bar that is held at one end, confined at its sides."""
    A, end = 1e-4, 7.3
    c = ((1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))) ** 0.5
    w = 0.5 * pi * c
    text = f"""
        duration = {end}
        outputs = 100
        [body.bar]
        shape = {{type = "interval", length = 1.0}}
        spacing = SPACING
        [[boundary]]
        type = "clamp"
        where = "left"
        [[initial]]
        velocity = {{x = "{A * w}*sin(0.5*pi*X)"}}
    """
    probes = (
        probe("end", "displacement x", 1.0)
        + probe("middle", "velocity x", 0.5)
        + probe("root", "stress xx", 0.0)
    )
    phase, half = w * end, sin(0.25 * pi)
    truth = {
        "final end displacement x [m]": A * sin(phase),
        "final middle velocity x [m/s]": A * w * half * cos(phase),
        "final root stress xx [Pa]": 0.5 * pi * c**2 * A * sin(phase),
    }
    return KnownScene(text + elastic() + probes, 0.1, truth)


KNOWN: Mapping[str, Callable[[], KnownScene]] = {
    "pressed ring": pressed_ring,
    "spinning ring": spinning_ring,
    "hollow ball": hollow_ball,
    "waves of displacement": waves_of_displacement,
    "cantilever": cantilever,
    "ringing bar": ringing_bar,
}
