"""How much of a cell lies in a shape: the cell is halved until each piece is in, out or tiny."""

from __future__ import annotations

import itertools

import attrs
import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices

# How often a cell is halved, for each dimension: to 1/16 in the plane, to 1/8 in space.
_HALVINGS = {1: 3, 2: 4, 3: 3}


@attrs.frozen(eq=False)
class Pieces:
    """Parts of cells that lie in a shape."""

    cells: Indices  # (m,) which of the cells each belongs to
    points: Array  # (m, d) where each is [m]
    shares: Array  # (m,) its volume by that of the cell [-]


def pieces(shape: Shape, centres: Array, steps: Array) -> Pieces:
    """What of the cells about `centres` (n, d) with edges `steps` (d,) lies in the `shape`."""
    dimension = len(steps)
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=dimension)))
    cells = np.arange(len(centres))
    found: list[tuple[Indices, Array, Array]] = []
    halvings = _HALVINGS[dimension]
    for level in range(1, halvings + 1):
        steps = 0.5 * steps
        centres = (centres[:, np.newaxis, :] + corners * steps).reshape(-1, dimension)
        cells = np.repeat(cells, len(corners))
        distance = shape.signed_distance(centres)
        if level == halvings:
            shares = _tiny(shape, centres, steps, corners, distance)
        else:
            # A piece that the boundary does not reach is settled; the others are halved again.
            reach = 0.5 * float(np.linalg.norm(steps))
            shares = (distance < -reach).astype(np.float64)
        kept = shares > 0.0
        found.append((cells[kept], centres[kept], shares[kept] / len(corners) ** level))
        if level < halvings:
            cut = np.abs(distance) <= reach
            centres, cells = centres[cut], cells[cut]
    return Pieces(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def finest_pieces(shape: Shape, centres: Array, steps: Array) -> Pieces:
    """The same, all of the last size, to tell which particle each is nearest to."""
    dimension = len(steps)
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=dimension)))
    cells = np.arange(len(centres))
    for _ in range(_HALVINGS[dimension]):
        steps = 0.5 * steps
        centres = (centres[:, np.newaxis, :] + corners * steps).reshape(-1, dimension)
        cells = np.repeat(cells, len(corners))
    shares = _tiny(shape, centres, steps, corners, shape.signed_distance(centres))
    kept = shares > 0.0
    size = float(len(corners)) ** -_HALVINGS[dimension]
    return Pieces(cells[kept], centres[kept], size * shares[kept])


def _tiny(shape: Shape, centres: Array, steps: Array, corners: Array, distance: Array) -> Array:
    """What part of each piece is inside, (m,) [-], where the boundary is as good as a plane.

    The distance of the plane from the centre tells, on average over the tilts of the plane. But
    only where corners of the piece lie clearly on both sides: the distance is 0 as well on a seam
    between parts of a union, and where what was taken away ends with the body.
    """
    shares = (distance < 0.0).astype(np.float64)
    width = float(steps.min())
    rounding = 1e-9 * width
    near = np.flatnonzero(np.abs(distance) < 0.5 * width - rounding)
    around = (centres[near, np.newaxis, :] + corners * steps).reshape(-1, len(steps))
    sides = shape.signed_distance(around).reshape(near.size, len(corners))
    some_inside = (sides < -rounding).any(axis=1)
    some_outside = (sides > rounding).any(axis=1)
    shares[near] = some_inside
    split = near[some_inside & some_outside]
    shares[split] = 0.5 - distance[split] / width
    return shares
