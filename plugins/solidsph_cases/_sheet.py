"""A square sheet of rubber with a round hole in its middle: its parts, and what is known of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isclose
from typing import Any

import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.scene.scene_data import PartLike
from solidsph.studies.case import Measurement
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import finished
from solidsph_cases._scene import ON_BOUNDARY, box, solid

MATERIAL = NeoHookean(youngs_modulus=70e6, poissons_ratio=0.49, density=1000.0)
"""The paper's, with a density that it does not give: it scales time only."""

# Finite elements and spectral elements of the fourth order agree on these to the last digit but
# one (tests/helpers/spectral_sheet.py).
_RATIO, _TRACTION = 0.2, 5e6
EXTENSION = 0.065058  # mean u_x of the loaded edge over W, at rest
PEAK = 16.74e6  # largest principal Cauchy stress, at (0, a), at rest [Pa]
NEAR_PEAK = 1.5  # [spacings]: the particle at (0, a), or one beside it
SOURCE = "finite elements of a quarter of the sheet, the same law and dead traction"


def is_known(hole_ratio: float, traction: float) -> bool:
    """True for the sheet and the load for which there are references."""
    return isclose(hole_ratio, _RATIO) and isclose(traction, _TRACTION)


def check_hole(case: str, hole_ratio: float, width: float, spacing: float) -> None:
    """Refuse holes that leave no sheet, and those smaller than a cell.

    Raises:
        SceneError: the hole is too large or too small.
    """
    if not 0.0 < hole_ratio <= 0.7:
        raise SceneError(
            f"case {case!r}: hole_ratio must lie between 0 and 0.7, got {hole_ratio}: it is the "
            "radius of the hole over half the side of the sheet"
        )
    if round(hole_ratio * cells(width, spacing)) < 1:
        raise SceneError(
            f"case {case!r}: a hole of radius {hole_ratio * width:.6g} m needs a spacing below it, "
            f"got {spacing:.6g} m; a third of it or less is sensible"
        )


def cells(width: float, spacing: float) -> int:
    """Cells of the lattice from the middle to an edge."""
    return max(1, round(width / spacing))


def quarter(side: float) -> Mapping[str, Any]:
    """A quarter of a square: its corner is the middle."""
    return box(side, side)


def whole(half: float) -> Mapping[str, Any]:
    """A square around the middle."""
    return box(2.0 * half, 2.0 * half, origin=[-half, -half])


Square = Callable[[float], Mapping[str, Any]]
"""A square by half the side of the whole: `quarter` or `whole`."""


def rows_along(square: Square, hole_ratio: float, width: float, spacing: float) -> PartLike:
    """Rows of particles that follow the hole, fading into a lattice towards the edges.

    A lattice around a square hole is moved outwards or inwards to the round one. Rows along the
    sides of the square then keep their spacing at the middle, where the stresses are read, and
    come closer at its corners.
    """
    count = cells(width, spacing)
    half = round(hole_ratio * count) * width / count
    size, distance = "max(abs(X), abs(Y))", "hypot(X, Y)"
    fading = f"({width!r} - {size})/{width - half!r}"
    factor = f"(1 + {fading}*({hole_ratio * width / half!r}*{size}/{distance} - 1))"
    return {
        "type": "mapped",
        "of": ON_BOUNDARY,
        "before": {"type": "difference", "of": square(width), "minus": square(half)},
        "to": {"x": f"X*{factor}", "y": f"Y*{factor}"},
    }


def sheet(
    *,
    title: str,
    square: Square,
    hole_ratio: float,
    width: float,
    spacing: float,
    discretisation: PartLike | None = None,
) -> SceneBuilder:
    """The sheet or a quarter of it, with its material and its two planes of symmetry, on which
    particles lie, so that no ghosts are needed."""
    shape = {
        "type": "difference",
        "of": square(width),
        "minus": {"type": "disc", "radius": hole_ratio * width},
    }
    spacing = width / cells(width, spacing)
    builder = solid(title, "sheet", shape, spacing, MATERIAL, discretisation=discretisation)
    return builder.boundary("symmetry", axis="x").boundary("symmetry", axis="y")


def extensions(record: Record) -> Array:
    """Mean u_x of the right edge at every time, (t,) [m]."""
    edge, X = record.particles.faces["right"], record.particles.positions
    u = record.positions[:][:, edge.particles, 0] - X[edge.particles, 0]
    return np.asarray(u @ edge.areas / edge.areas.sum())


def largest_stresses(record: Record) -> Array:
    """Largest principal Cauchy stress anywhere at every time, (t,) [Pa]."""
    return np.array([largest_principal(stress).max() for stress in record.field("cauchy_stress")])


def at_hole(record: Record, radius: float, degrees: float) -> int:
    """The particle on the hole that is nearest to that angle from the axis of the load."""
    angle = np.radians(degrees)
    place = radius * np.array([np.cos(angle), np.sin(angle)])
    return int(np.argmin(np.linalg.norm(record.particles.positions - place, axis=1)))


def peak_distance(record: Record, radius: float, known: bool) -> Measurement:
    """Distance of the largest stress at the end from (0, a), its place in theory.

    Args:
        known: True if it must be there; if not, every distance passes.
    """
    stress = largest_principal(record.field("cauchy_stress")[-1])
    place = record.particles.positions[np.argmax(stress)] - [0.0, radius]
    away = float(np.linalg.norm(place) / record.particles.spacings[0])
    near = away <= NEAR_PEAK
    return Measurement(
        "largest stress at rest: distance from (0, a)",
        away,
        "spacings",
        verdict=f"{'within' if near else 'NOT within'} {NEAR_PEAK:g} spacings",
        passed=finished(record) and (near or not known),
    )
