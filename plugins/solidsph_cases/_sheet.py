"""A square sheet of rubber with a round hole in its middle: its parts, and what is known of it."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose
from typing import Any

import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.scene.scene_data import PartLike
from solidsph.simulation import Simulation
from solidsph.studies.case import Measurement
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import FINISHED

MATERIAL = NeoHookean(youngs_modulus=70e6, poissons_ratio=0.49, density=1000.0)
"""The paper's, with a density that it does not give: it scales time only."""

# Where they were asked, finite elements and spectral elements of the fourth order agree on these
# to the last digit but one (tests/helpers/spectral_sheet.py).
_RATIO, _TRACTION = 0.2, 5e6
EXTENSION = 0.065058  # mean u_x of the loaded edge over W, at rest
PEAK = 16.74e6  # largest principal Cauchy stress, at (0, a), at rest [Pa]
NEAR_PEAK = 1.5  # [spacings]: the particle at (0, a), or one beside it
SOURCE = "finite elements of a quarter of the sheet, the same law and dead traction"


def is_known(hole_ratio: float, traction: float) -> bool:
    """Whether these are the sheet and the load for which there are references."""
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
    if half_square(hole_ratio, cells(width, spacing)) < 1:
        raise SceneError(
            f"case {case!r}: a hole of radius {hole_ratio * width:.6g} m needs a spacing below it, "
            f"got {spacing:.6g} m; a third of it or less is sensible"
        )


def cells(width: float, spacing: float) -> int:
    """Of the lattice, from the middle to an edge."""
    return max(1, round(width / spacing))


def half_square(hole_ratio: float, count: int) -> int:
    """Half the side of a square hole in a lattice of `count` cells to the edge, in cells.

    It goes around the round one: rows along its sides then keep their spacing at the middle,
    where the stresses are read, and come closer at its corners.
    """
    return round(hole_ratio * count)


def pushed(width: float, radius: float, half: float) -> Mapping[str, str]:
    """Formulas that move a lattice around a square hole, of half the side `half` [m], to the round
    one, fading into itself towards the edges."""
    size, distance = "max(abs(X), abs(Y))", "hypot(X, Y)"
    fading = f"({width!r} - {size})/{width - half!r}"
    factor = f"(1 + {fading}*({radius / half!r}*{size}/{distance} - 1))"
    return {"x": f"X*{factor}", "y": f"Y*{factor}"}


def rows_along(hole_ratio: float, width: float, spacing: float) -> Mapping[str, Any]:
    """Rows of particles that follow the hole, in a quarter."""
    count = cells(width, spacing)
    half = half_square(hole_ratio, count) * width / count
    return {
        "type": "mapped",
        "of": {"type": "lattice", "on_boundary": True},
        "before": {"type": "difference", "of": _square(width), "minus": _square(half)},
        "to": pushed(width, hole_ratio * width, half),
    }


def quarter(
    hole_ratio: float, width: float, spacing: float, discretisation: PartLike
) -> SceneBuilder:
    """A quarter of the sheet with its material and its two planes of symmetry, on which particles
    lie, so that no ghosts are needed."""
    return (
        Simulation.builder()
        .body(
            "sheet",
            shape={
                "type": "difference",
                "of": _square(width),
                "minus": {"type": "disc", "radius": hole_ratio * width},
            },
            spacing=width / cells(width, spacing),
            discretisation=discretisation,
        )
        .material(
            "neo-hookean",
            youngs_modulus=MATERIAL.youngs_modulus,
            poissons_ratio=MATERIAL.poissons_ratio,
            density=MATERIAL.density,
        )
        .boundary("symmetry", axis="x")
        .boundary("symmetry", axis="y")
    )


def _square(side: float) -> Mapping[str, Any]:
    return {"type": "box", "lengths": [side, side]}


def extensions(record: Record) -> Array:
    """Mean u_x of the right edge at every time, (t,) [m]."""
    edge, X = record.particles.faces["right"], record.particles.positions
    u = record.positions[:][:, edge.particles, 0] - X[edge.particles, 0]
    mean: Array = u @ edge.areas / edge.areas.sum()
    return mean


def at_hole(record: Record, radius: float, degrees: float) -> int:
    """The particle nearest to that angle from the load's axis, on the hole."""
    angle = np.radians(degrees)
    place = radius * np.array([np.cos(angle), np.sin(angle)])
    return int(np.argmin(np.linalg.norm(record.particles.positions - place, axis=1)))


def peak_distance(record: Record, radius: float, known: bool) -> Measurement:
    """How far from (0, a), where theory has it, the largest stress of the end is.

    Args:
        known: whether it is known to be there; if not, every distance passes.
    """
    stress = largest_principal(record.field("cauchy_stress")[-1])
    place = record.particles.positions[np.argmax(stress)] - [0.0, radius]
    away = float(np.linalg.norm(place) / record.particles.spacings[0])
    near = away <= NEAR_PEAK
    return Measurement(
        quantity="largest stress at rest: distance from (0, a)",
        value=away,
        unit="spacings",
        verdict=f"{'within' if near else 'NOT within'} {NEAR_PEAK:g} spacings",
        passed=record.outcome == FINISHED and (near or not known),
    )


def crossing_time(width: float) -> float:
    """Time in which a small pressure wave crosses a quarter of the sheet, W / c_p [s]."""
    return width / MATERIAL.wave_speed
