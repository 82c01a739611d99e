"""The part of a cell in a shape: the cell is halved until each piece is in, out or tiny."""

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

    cells: Indices  # (m,) the cell that each belongs to
    points: Array  # (m, d) its centre [m]
    shares: Array  # (m,) its volume over that of the cell [-]


def pieces(shape: Shape, centres: Array, steps: Array) -> Pieces:
    """The parts in the `shape` of cells about `centres` (n, d) with edges `steps` (d,)."""
    return _divided(shape, centres, steps, all_tiny=False)


def finest_pieces(
    shape: Shape, centres: Array, steps: Array, halvings: int | None = None
) -> Pieces:
    """The same parts, all of the last size, that after so many `halvings` or the usual number."""
    return _divided(shape, centres, steps, all_tiny=True, halvings=halvings)


def _divided(
    shape: Shape, centres: Array, steps: Array, *, all_tiny: bool, halvings: int | None = None
) -> Pieces:
    dimension = len(steps)
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=dimension)))
    cells = np.arange(len(centres))
    cut, distance = np.ones(len(centres), dtype=np.bool_), np.zeros(len(centres))
    settled: list[tuple[Indices, Array, Array]] = []
    halvings = _HALVINGS[dimension] if halvings is None else halvings
    for level in range(1, halvings + 1):
        steps = 0.5 * steps
        centres = (centres[:, np.newaxis, :] + corners * steps).reshape(-1, dimension)
        cells, cut = np.repeat(cells, len(corners)), np.repeat(cut, len(corners))
        distance = np.repeat(distance, len(corners))
        # Parts of what the boundary does not reach are on the same side.
        distance[cut] = shape.signed_distance(centres[cut])
        reach = 0.5 * float(np.linalg.norm(steps))
        cut &= np.abs(distance) <= reach
        if level == halvings:
            shares = _tiny(shape, centres, steps, corners, distance)
        elif all_tiny:
            continue
        else:
            # A piece that the boundary does not reach is settled; the others are halved again.
            shares = (distance < -reach).astype(np.float64)
        kept = shares > 0.0
        settled.append((cells[kept], centres[kept], shares[kept] / len(corners) ** level))
        if level < halvings:
            centres, cells, distance, cut = centres[cut], cells[cut], distance[cut], cut[cut]
    return Pieces(*(np.concatenate(parts) for parts in zip(*settled, strict=True)))


def _tiny(shape: Shape, centres: Array, steps: Array, corners: Array, distance: Array) -> Array:
    """Share of each piece inside, (m,) [-], with the boundary taken as a plane.

    It follows from the distance of the plane from the centre, on average over its tilts, if corners
    of the piece are clearly on both sides. If not, a distance of 0 is that of a seam between parts
    of a union, or of a removed shape that ends with the body.
    """
    shares = (distance < 0.0).astype(np.float64)
    width = float(steps.min())
    rounding = 1e-9 * width
    near = np.flatnonzero(np.abs(distance) < 0.5 * width - rounding)
    # So near to the nearest place of a boundary, a piece is on both sides.
    if shape.nearest(centres[:1]) is not None:
        shares[near] = 0.5 - distance[near] / width
        return shares
    around = (centres[near, np.newaxis, :] + corners * steps).reshape(-1, len(steps))
    sides = shape.signed_distance(around).reshape(near.size, len(corners))
    some_inside = (sides < -rounding).any(axis=1)
    some_outside = (sides > rounding).any(axis=1)
    shares[near] = some_inside
    split = near[some_inside & some_outside]
    shares[split] = 0.5 - distance[split] / width
    return shares
