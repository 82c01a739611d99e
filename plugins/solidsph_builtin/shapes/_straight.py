"""Plane shapes whose outline is made of straight edges."""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes._outline import ClosedLines
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.outline import Outline
from solidsph_builtin.shapes.polygon import Polygon

# Gauss's rule on an edge: exact for polynomials of up to the fifth degree.
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def straight_outline(shape: Shape) -> ClosedLines | None:
    """The edges of a plane shape, counterclockwise; None if they are not straight, or not known."""
    if isinstance(shape, (Polygon, Outline)):
        return shape.outline
    if isinstance(shape, Box) and shape.dimension == 2:
        (left, bottom), (right, top) = shape.bounds()
        corners = [[left, bottom], [right, bottom], [right, top], [left, top]]
        return ClosedLines.of([np.array(corners)])
    return None


def right_integral(lines: ClosedLines, p: int, q: int, y: float) -> float:
    """The integral of x^p (y' - y)^q over the part at x > 0 of what is enclosed, for p > 0 and
    p + q at most 3.

    By Green's theorem on the outline, exact up to rounding: the integrand vanishes at x = 0, where
    the outline is cut.
    """
    starts, ends = lines.starts, lines.starts + lines.edges
    kept = (starts[:, 0] > 0.0) | (ends[:, 0] > 0.0)
    a, b = _cut(starts[kept], ends[kept]), _cut(ends[kept], starts[kept])
    x, height = ((0.5 * (a + b))[..., None] + (0.5 * (b - a))[..., None] * _PLACES).swapaxes(0, 1)
    along = x ** (p + 1) / (p + 1) * (height - y) ** q @ _WEIGHTS
    return float(along @ (0.5 * (b - a)[:, 1]))


def _cut(ends: Array, others: Array) -> Array:
    """Ends of edges (m, 2), moved towards the others (m, 2) to x = 0 where they are beyond it."""
    beyond = ends[:, 0] < 0.0
    part = np.zeros(len(ends))
    part[beyond] = ends[beyond, 0] / (ends[beyond, 0] - others[beyond, 0])
    return np.asarray(ends + part[:, None] * (others - ends))
