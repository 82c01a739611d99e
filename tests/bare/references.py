"""Bodies without a closed form, by finite elements: Cook's membrane and the sheet with a hole."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solidsph.maths.arrays import Array
from tests.bare.finite_elements import Map, Mesh, Solid, graded


def cook(
    cells: int, poissons_ratio: float, youngs_modulus: float, shear: float, size: float
) -> float:
    """u_y in the middle of the right edge of Cook's membrane [m].

    Args:
        cells: along each side; finer towards the clamped end and the corners there.
        shear: dead traction upwards on the right edge [Pa].
        size: of a unit of Cook's drawing [m].
    """

    def place(s: Array, t: Array) -> tuple[Array, Array]:
        low, high = 44.0 * s, 44.0 + 16.0 * s
        return size * 48.0 * s, size * (low + t * (high - low))

    # An even number of cells has a node in the middle.
    mesh = Mesh.of([(place, graded(cells, 3.0), graded(cells, 2.0, 2.0))])
    X = mesh.nodes
    right = X[:, 0] > size * (48.0 - 1e-6)
    loads = mesh.side_loads(right, lambda x: np.tile([0.0, shear], (len(x), 1)))
    held = np.repeat(X[:, :1] < size * 1e-6, 2, axis=1)
    solution = Solid.of(mesh, youngs_modulus, poissons_ratio).equilibrium(held, loads)
    middle = int(np.argmin(np.hypot(X[:, 0] - 48.0 * size, X[:, 1] - 52.0 * size)))
    return float(solution.u[middle, 1])


def sheet(
    cells: int,
    poissons_ratio: float,
    youngs_modulus: float = 70e6,
    traction: float = 5e6,
    hole: float = 0.2,
) -> tuple[float, float]:
    """Mean u_x of the pulled edge over W, and the largest principal Cauchy stress at (0, a) [Pa].

    A quarter of the sheet, of side W = 1 m.

    Args:
        cells: from the hole to an edge, and along each half of the hole's arc.
        traction: dead, on the right edge [Pa].
        hole: radius over W.
    """

    s, t = graded(cells, 1.5), graded(cells)
    halves = [
        sector(first, first + 0.25 * np.pi, hole, lambda ray: 1.0 / np.abs(ray).max(axis=0))
        for first in (0.0, 0.25 * np.pi)
    ]
    mesh = Mesh.of([(half, s, t) for half in halves])
    X = mesh.nodes
    loads = mesh.side_loads(X[:, 0] > 1.0 - 1e-9, lambda x: np.tile([traction, 0.0], (len(x), 1)))
    held = X < 1e-9
    solution = Solid.of(mesh, youngs_modulus, poissons_ratio).equilibrium(held, loads)
    top = int(np.argmin(np.hypot(X[:, 0], X[:, 1] - hole)))
    extension = np.sum(loads[:, 0] * solution.u[:, 0]) / np.sum(loads[:, 0])
    return float(extension), float(np.linalg.eigvalsh(solution.cauchy(top))[-1])


def sector(first: float, last: float, inner: float, outer: Callable[[Array], Array | float]) -> Map:
    """Between two angles, from a circle to what is `outer` (...,) far along rays (2, ...)."""

    def place(s: Array, t: Array) -> tuple[Array, Array]:
        angle = first + t * (last - first)
        ray = np.stack([np.cos(angle), np.sin(angle)])
        x, y = ray * (inner + s * (outer(ray) - inner))
        return x, y

    return place
