"""Fields over plane bodies: smooth colours between particles, outlines, and single particles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import Delaunay

from solidsph.maths.arrays import Array, Indices
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph_cases.drawing.sheet import Mark, mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Neighbours in a lattice are up to its diagonal apart; a longer edge spans a hole.
_LONGEST_EDGE = 1.9  # spacings

LARGEST_STRESS = "largest principal Cauchy stress"


def principal_stress(record: Record, step: int, scale: float = 1e-6) -> Array:
    """Largest principal Cauchy stress of every particle times `scale`, in MPa by default, (n,)."""
    return scale * largest_principal(record.field("cauchy_stress")[step])


def field(record: Record, step: int, values: Array, **style: Any) -> Mark:
    """The body of `step`, coloured by `values` (n,), smoothly between particles."""

    def draw(axes: Axes) -> Any:
        from matplotlib.tri import Triangulation

        x, y = record.positions[step].T
        mesh = Triangulation(x, y, triangles(record))
        axes.set_aspect("equal")
        return axes.tripcolor(mesh, values, **{"shading": "gouraud", "cmap": "cividis"} | style)

    return draw


def triangles(record: Record) -> Indices:
    """Triangles between neighbouring particles, (m, 3), from the reference configuration."""
    particles = record.particles
    found = np.asarray(Delaunay(particles.positions).simplices, dtype=np.intp)
    corners = particles.positions[found]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    short = edges.max(axis=1) < _LONGEST_EDGE * float(particles.spacings.max())
    # Between particles that all lie on a curved boundary there is none of the body.
    surface = particles.tags["surface"][found].all(axis=1)
    doubled_areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    thin = doubled_areas < 0.1 * float(particles.spacings.min()) ** 2
    kept: Indices = found[short & ~(surface & thin)]
    return kept


def scatter(x: Array, values: Array, cmap: str, **style: Any) -> Mark:
    """Particles at x (n, d), coloured by `values` (n,)."""
    return mark("scatter", *x.T, c=values, cmap=cmap, **style)


def outline(x: Array, **style: Any) -> Mark:
    """Dots at x (n, 2), such as the places of a surface at another time."""
    return mark("plot", *x.T, ".", **{"color": "0.55", "markersize": 1.5} | style)


def circle(radius: float, turns: float = 1.0) -> Array:
    """Points on a circle about 0 from (radius, 0) on, (2, k)."""
    turn = np.linspace(0.0, 2.0 * np.pi * turns, 200)
    return radius * np.array([np.cos(turn), np.sin(turn)])


def quarter_circle(radius: float) -> Array:
    """Points from (radius, 0) to (0, radius), (2, k)."""
    return circle(radius, 0.25)


def quarter_sheet(radius: float, width: float) -> Array:
    """The outline of a quarter of a square sheet with a hole, (2, k)."""
    x, y = quarter_circle(radius)[:, ::-1]
    return np.array([[*x, width, width, 0.0, 0.0], [*y, 0.0, width, width, radius]])


def quarter_particles(record: Record, width: float) -> list[Mark]:
    """Particles inside and on the boundary, in widths."""
    x, surface = record.particles.positions / width, record.particles.tags["surface"]
    return [
        mark("plot", *x[~surface].T, "o", color="0.6", markersize=3.5, label="inside"),
        mark("plot", *x[surface].T, "ko", markersize=4.5, label="on the boundary"),
    ]
