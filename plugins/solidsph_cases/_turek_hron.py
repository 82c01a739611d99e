"""The elastic beam of Turek and Hron's structure tests, the two ways to hold it, its picture."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from math import sqrt
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_builtin.materials.saint_venant_kirchhoff import SaintVenantKirchhoff
from solidsph_cases._scene import box, solid
from solidsph_cases.drawing.fields import LARGEST_STRESS, field, outline, principal_stress
from solidsph_cases.drawing.sheet import BELOW, Bar, Mark, Panel, line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SOURCE = "Turek & Hron (2006), Proposal for numerical benchmarking, section 4.2"
OURS = "quadratic finite elements refined towards the clamp, extrapolated"

LENGTH = 0.35  # from the foremost point of the disc to the free end [m]
HEIGHT = 0.02  # [m]
RADIUS = 0.05  # of the disc [m]
GRAVITY = 2.0  # [m/s^2]


@attrs.frozen
class Clamp:
    """Where the beam is held, and what is known of its tip when it is held so."""

    face: str
    shape: Mapping[str, Any]
    source: str
    rest: tuple[float, float]  # displacement of the tip in equilibrium [m]
    first_minimum: float  # of u_y after release [m]
    first_minimum_time: float  # [s]
    # Mean and amplitude of u_x and of u_y in the last period of ten seconds [m], frequency [Hz].
    oscillation: tuple[float, float, float, float, float] | None


_MATERIAL = SaintVenantKirchhoff(youngs_modulus=1.4e6, poissons_ratio=0.4, density=1000.0)

STRAIGHT = Clamp(
    face="left",
    shape=box(LENGTH, HEIGHT, origin=[0.0, -0.5 * HEIGHT]),
    source=OURS,
    rest=(-7.087e-3, -65.568e-3),
    first_minimum=-128.66e-3,
    first_minimum_time=0.456,
    oscillation=None,
)

# The published beam ends on the disc: its edges meet the arc this far behind the foremost point.
_CORNER = sqrt(RADIUS**2 - (0.5 * HEIGHT) ** 2) - RADIUS  # [m]

ARC = Clamp(
    face="rim",
    shape={
        "type": "difference",
        "of": box(LENGTH - _CORNER, HEIGHT, origin=[_CORNER, -0.5 * HEIGHT]),
        "minus": {"type": "disc", "radius": RADIUS, "centre": [-RADIUS, 0.0]},
    },
    source=SOURCE,
    rest=(-7.187e-3, -66.10e-3),
    first_minimum=-129.73e-3,
    first_minimum_time=0.455,
    oscillation=(-14.305e-3, 14.305e-3, -63.607e-3, 65.160e-3, 1.0995),
)

CLAMPS: Mapping[str, Clamp] = {"arc": ARC, "straight": STRAIGHT}


def clamp_named(case: str, name: str) -> Clamp:
    """The clamp of that name.

    Raises:
        SceneError: there is none.
    """
    if name not in CLAMPS:
        near = difflib.get_close_matches(name, CLAMPS, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(CLAMPS)}"
        raise SceneError(f"case {case!r}: unknown clamp {name!r}; {hint}")
    return CLAMPS[name]


def beam(title: str, clamp: Clamp, across: int) -> SceneBuilder:
    """The beam under gravity, with so many particles across, both surfaces included.

    With an even number across, the tip lies halfway between two particles.
    """
    spacing = HEIGHT / (across - 1)
    tags = {"tip": f"X > {LENGTH - 0.1 * spacing!r} and abs(Y) < {0.6 * spacing!r}"}
    return (
        solid(title, "beam", clamp.shape, spacing, _MATERIAL, tags=tags)
        .boundary("clamp", where=clamp.face)
        .effect("body-force", acceleration={"y": -GRAVITY}, label="gravity")
    )


def tip(record: Record) -> Array:
    """Displacement of mid-height at the free end at every time, (t, 2) [m]."""
    X, chosen = record.particles.positions, record.particles.tagged("tip")
    return np.asarray(record.positions[:][:, chosen].mean(axis=1) - X[chosen].mean(axis=0))


def extremum(times: Array, values: Array, index: int) -> tuple[float, float]:
    """Time and value of the extremum near `index`, by the parabola through three outputs."""
    if not 0 < index < len(values) - 1:
        return float(times[index]), float(values[index])
    near = slice(index - 1, index + 2)
    a, b, c = np.polyfit(times[near] - times[index], values[near], 2)
    if a == 0.0:
        return float(times[index]), float(values[index])
    return float(times[index] - 0.5 * b / a), float(c - 0.25 * b**2 / a)


def beam_panel(record: Record, step: int, held: Clamp, title: str, *marks: Mark) -> Panel:
    """The beam coloured by stress, what holds it, and where it was without its weight."""
    return Panel(
        outline(record.particles.positions[record.particles.tagged("surface")], color="0.75"),
        _disc if held is ARC else line([0.0, 0.0], [-0.03, 0.03], "-", color="0.4", linewidth=3.0),
        field(record, step, principal_stress(record, step, 1e-3)),
        *marks,
        title=title,
        x="x [m]",
        y="y [m]",
    )


def stress_bar(body: Panel) -> Bar:
    """The colour bar below the beam."""
    return Bar(f"{LARGEST_STRESS} [kPa]", [body], {**BELOW, "shrink": 0.6})


def _disc(axes: Axes) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(Circle((-RADIUS, 0.0), RADIUS, facecolor="0.8", edgecolor="0.4"))
