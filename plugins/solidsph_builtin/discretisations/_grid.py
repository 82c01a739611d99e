"""Grid: equal cells over the bounding box of a shape, one lattice point to each."""

from __future__ import annotations

import math
from collections.abc import Callable

import attrs
import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.discretisations._checks import check_count, refusal
from solidsph_builtin.shapes._sampling import cells_along

# Points handled at once: enough for NumPy to be efficient, few enough to stay in the cache.
_CHUNK = 1 << 15

# Points this close to one of the lattice are there, in cells.
_AT = 1e-6

# What is thinner than this part of its length has no extent: rounding moves its surface.
_FLAT = 1e-9


@attrs.frozen(eq=False)
class Grid:
    """Lattice points, and the cell around each.

    They are numbered along the axis with most points first, so that long runs of them have the
    same neighbourhood: engines process such a run as a whole.
    """

    lower: Array  # (d,) lower corner of the bounding box [m]
    lengths: Array  # (d,) of the bounding box [m]
    cells: tuple[int, ...]  # number that fills the bounding box along each axis
    first: float  # place of the first point along an axis, in cells from the lower corner
    counts: tuple[int, ...]  # lattice points along each axis, including those beyond the box

    @property
    def steps(self) -> Array:
        """Size of a cell along each axis (d,) [m]."""
        result: Array = self.lengths / np.array(self.cells)
        return result

    @property
    def size(self) -> int:
        """Number of lattice points."""
        return math.prod(self.counts)

    @property
    def order(self) -> tuple[int, ...]:
        """Axes from the slowest in the numbering to the fastest; the last of equal ones."""
        return tuple(sorted(range(len(self.counts)), key=lambda axis: self.counts[axis]))

    @property
    def shape(self) -> tuple[int, ...]:
        """Lattice points along the axes in that order."""
        return tuple(self.counts[axis] for axis in self.order)

    @property
    def cell_volume(self) -> float:
        """Volume of one cell [m^d]."""
        return float(np.prod(self.steps))

    @property
    def half_diagonal(self) -> float:
        """Distance from the centre of a cell to its corners [m]."""
        return 0.5 * float(np.linalg.norm(self.steps))

    def positions(self, numbers: Indices) -> Array:
        """Lattice points of these `numbers` (n,), (n, d) [m]."""
        index = np.stack(np.unravel_index(numbers, self.shape), axis=1)
        index = index[:, np.argsort(self.order)]
        # Without the step, which is rounded: the last point is exactly on the far face.
        result: Array = self.lower + (index + self.first) / np.array(self.cells) * self.lengths
        return result

    def has(self, points: Array) -> Mask:
        """Which of `points` (m, d) are lattice points, up to a millionth of a cell, (m,)."""
        places = (points - self.lower) / self.steps - self.first
        return np.asarray((np.abs(places - np.rint(places)) <= _AT).all(axis=1))

    def snapped(self, points: Array) -> tuple[Array, Mask]:
        """Points (m, d), those at a point of the lattice to the last bit, and which these are
        (m,)."""
        there = self.positions(self.cell_of(points))
        at = np.abs((points - there) / self.steps).max(axis=1, initial=0.0) <= _AT
        return np.where(at[:, None], there, points), at

    def cell_of(self, points: Array) -> Indices:
        """Number of the cell that holds each of `points` (n, d), or the nearest one, (n,)."""
        index = np.rint((points - self.lower) / self.steps - self.first).astype(np.intp)
        index = np.clip(index, 0, np.array(self.counts) - 1)
        index = index[:, self.order]
        return np.asarray(np.ravel_multi_index(tuple(index.T), self.shape), dtype=np.intp)

    def near(self, marked: Mask, layers: int) -> Mask:
        """Points at most so many `layers` of cells away from a `marked` one, (size,)."""
        grown = marked.reshape(self.shape)
        for axis in range(grown.ndim):
            along = np.moveaxis(grown, axis, 0)
            wider = along.copy()
            for shift in range(1, layers + 1):
                wider[shift:] |= along[:-shift]
                wider[:-shift] |= along[shift:]
            grown = np.moveaxis(wider, 0, axis)
        return grown.ravel()

    def completed(self, occupied: Mask) -> Array:
        """Share of each cell with `occupied` points on both sides along every axis, (size,)."""
        filled = occupied.reshape(self.shape)
        part = np.ones(self.shape)
        for axis in range(filled.ndim):
            along, own = np.moveaxis(filled, axis, 0), np.moveaxis(part, axis, 0)
            own[1:] *= np.where(along[:-1], 1.0, 0.5)
            own[:-1] *= np.where(along[1:], 1.0, 0.5)
            own[0] *= 0.5
            own[-1] *= 0.5
        return part.ravel()


def grid_over(
    discretisation: Discretisation,
    shape: Shape,
    spacing: float,
    *,
    on_boundary: bool = False,
    beyond: int = 0,
) -> Grid:
    """The grid over the bounding box of `shape` with cells whose size is nearest to `spacing`.

    Args:
        discretisation: the part that messages name.
        shape: the shape to be covered.
        spacing: requested size of the cells [m].
        on_boundary: True for points on the faces of the box, not half a cell inside.
        beyond: layers of lattice points beyond the box.

    Raises:
        SceneError: the shape has no extent, the spacing exceeds it, or there would be too many
            points.
    """
    lower, upper = shape.bounds()
    lengths = upper - lower
    if not (np.isfinite(lengths).all() and lengths.min() > _FLAT * lengths.max()):
        raise refusal(
            discretisation,
            f"the shape has no extent: its bounds are {lower.tolist()} and {upper.tolist()} m; "
            "give it sizes that do not vanish beside its coordinates",
        )
    if on_boundary and spacing > 2.0 * lengths.max():
        raise refusal(
            discretisation,
            f"spacing = {spacing:.4g} m is larger than the shape, of {lengths.max():.4g} m; take a "
            "sixth of its thickness or less, or check the unit of the shape",
        )
    extra = int(on_boundary) + 2 * beyond
    # In floating point: the product may be too large for an integer.
    check_count(discretisation, math.prod(length / spacing + extra for length in lengths.tolist()))
    cells = tuple(cells_along(length, spacing) for length in lengths.tolist())
    return Grid(
        lower=lower,
        lengths=lengths,
        cells=cells,
        first=(0.0 if on_boundary else 0.5) - beyond,
        counts=tuple(count + extra for count in cells),
    )


def in_chunks(size: int, values: Callable[[Indices], Array]) -> Array:
    """`values` of the numbers 0 to `size`, computed in chunks to bound the memory, (size,)."""
    result = np.empty(size)
    for start in range(0, size, _CHUNK):
        numbers = np.arange(start, min(start + _CHUNK, size))
        result[start : start + _CHUNK] = values(numbers)
    return result
