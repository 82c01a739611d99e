"""Conforming lattice: particles in rows and columns, the outermost moved onto the boundary."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._cells import cell_shares, fitted, mean_spacing
from solidsph_builtin.discretisations._checks import check_spacing, refusal
from solidsph_builtin.discretisations._features import Features, gap, meetings, smooth
from solidsph_builtin.discretisations._feet import on_boundary
from solidsph_builtin.discretisations._grid import Grid, grid_over, in_chunks
from solidsph_builtin.discretisations._nearest import nearest, thinned
from solidsph_builtin.discretisations._pieces import finest_pieces
from solidsph_builtin.discretisations._surface import faces, sampled, without_ghosts

# Closer than this, in cells, a point is on the boundary, or two points coincide.
_AT = 1e-9
# Two particles on the boundary closer than this, in cells, become one.
_CLOSEST = 0.5
# How much more finely than the particles the boundary is sampled, in each dimension.
_FINER = {1: 1.0, 2: 4.0, 3: 2.0}
_CELLS_AT_ONCE = 1024


@final
@attrs.frozen
class ConformingLattice(Discretisation):
    """A lattice whose outermost particles lie on the boundary of any shape.

    It starts from a lattice with points on the faces of the bounding box. Every point whose cell
    the boundary crosses, inside or outside, is moved to the nearest place on the boundary, or onto
    an edge or a corner in its cell: so each corner has a particle, also where an arc meets a
    straight line. Of points closer to each other than half a spacing, one is kept. A box aligned
    with the axes has the particles of `lattice` with `on_boundary`.

    The volume of a particle is the part of the shape nearest to it; the total is exact if the
    shape knows its volume. Particles are in the order of the lattice points. Tags: each face of
    the shape, `surface` and `interior`. There are no ghosts: behind a curved boundary their places
    are not defined.
    """

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """Particles of the lattice, the outermost on the boundary.

        Raises:
            SceneError: the spacing is not positive, so large that no particle is left, or so
                small that there would be too many.
        """
        spacing = check_spacing(self, spacing)
        grid = grid_over(self, shape, spacing, on_boundary=True)
        distance = in_chunks(grid.size, lambda n: shape.signed_distance(grid.positions(n)))
        surface = sampled(self, shape, spacing)
        found = _arranged(shape, grid, distance, spacing)
        numbers, onto, positions = found.numbers, found.onto, found.positions
        if not numbers.size:
            raise refusal(
                self,
                f"no particle of the lattice with spacing {spacing:g} m belongs to the shape; use "
                f"a smaller spacing (its bounding box measures {grid.lengths.tolist()} m)",
            )
        volumes = fitted(
            _volumes(shape, grid, distance, found.changed, numbers, positions),
            grid.cell_volume,
            shape.volume(),
        )
        # A particle on a seam where a composite shape closes up has no volume.
        kept = volumes > _AT * grid.cell_volume
        positions, volumes, onto = positions[kept], volumes[kept], onto[kept]
        outermost = np.flatnonzero(onto)
        owners = nearest(cKDTree(positions[outermost]), surface.points)
        owners = attrs.evolve(owners, particles=outermost[owners.particles])
        owned = faces(surface, owners, positions)
        return without_ghosts(positions, volumes, mean_spacing(grid, spacing), owned)

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        """True: this is what it is for."""
        return True


def outermost(shape: Shape, grid: Grid, distance: Array, spacing: float) -> tuple[Array, Mask]:
    """The particles on the boundary of `shape`, (m, d) [m], by a `grid` with points on it, and
    which of them are on no edge or corner, (m,).

    `distance` (size,) [m] is that of the points of the grid.
    """
    found = _arranged(shape, grid, distance, spacing)
    return found.positions[found.onto], found.on_smooth[found.onto]


@attrs.frozen(eq=False)
class _Arrangement:
    """Lattice points that are particles."""

    numbers: Indices  # (n,)
    onto: Mask  # (n,) whether they are on the boundary
    on_smooth: Mask  # (n,) and there on no edge or corner
    positions: Array  # (n, d) [m]
    changed: Mask  # (size,) points of the whole lattice that have moved, or are no particles


def _arranged(shape: Shape, grid: Grid, distance: Array, spacing: float) -> _Arrangement:
    """The particles of a lattice, given the distances (size,) [m] of its points."""
    d = shape.dimension
    surface = shape.surface(spacing / _FINER[d])
    reach = gap(surface)
    inside = distance <= _AT * float(grid.steps.min())
    # Cells are cubes in units of their edges: the boundary crosses one if it is that near.
    near = np.flatnonzero(np.abs(distance) <= grid.half_diagonal * (1.0 + _AT))
    scaled = cKDTree(surface.points / grid.steps)
    gaps, _ = scaled.query(grid.positions(near) / grid.steps, p=np.inf)
    crossed = near[gaps <= 0.5 + _AT]
    start = grid.positions(crossed)

    kinds = [smooth(surface)]
    for _ in range(1, d):
        kinds.append(meetings(kinds[-1], reach))
    places, rank = start.copy(), np.zeros(crossed.size, dtype=np.intp)
    for codimension, features in enumerate(kinds, start=1):
        chosen, found = _feet(features, grid, start, reach, everywhere=codimension == 1)
        places[chosen], rank[chosen] = found, codimension
    moved = on_boundary(shape, surface, places, spacing)
    # Points that are on the boundary already stay in place to the last bit.
    still = np.abs((moved - start) / grid.steps).max(axis=1, initial=0.0) <= _AT
    moved[still] = start[still]

    way = np.round(np.linalg.norm((moved - start) / grid.steps, axis=1), 6)
    order = np.lexsort((crossed, ~inside[crossed], way, -rank))
    stays = thinned(moved / grid.steps, order, _CLOSEST * (1.0 - _AT))

    positions = grid.positions(np.arange(grid.size))
    positions[crossed] = moved
    onto = np.zeros(grid.size, dtype=np.bool_)
    onto[crossed[stays]] = True
    on_smooth = np.zeros(grid.size, dtype=np.bool_)
    on_smooth[crossed[stays & (rank == 1)]] = True
    is_particle = inside.copy()
    is_particle[crossed] = stays
    changed = np.zeros(grid.size, dtype=np.bool_)
    changed[crossed] = ~still | ~stays
    numbers = np.flatnonzero(is_particle)
    return _Arrangement(numbers, onto[numbers], on_smooth[numbers], positions[numbers], changed)


def _feet(
    features: Features, grid: Grid, start: Array, reach: float, *, everywhere: bool
) -> tuple[Indices, Array]:
    """Which of the lattice points `start` (m, d) move onto features (k,), and to where (k, d) [m].

    All of them, or with `everywhere` false those with a feature in their cell.
    """
    if not len(features.points):
        return np.empty(0, dtype=np.intp), np.empty((0, start.shape[1]))
    if everywhere:
        chosen, nearest_at = np.arange(len(start)), cKDTree(features.points).query(start)[1]
    else:
        scaled = cKDTree(features.points / grid.steps)
        gaps, nearest_at = scaled.query(start / grid.steps, p=np.inf)
        chosen = np.flatnonzero(gaps <= 0.5 + _AT)
    first = np.asarray(nearest_at)[chosen]
    own = Features(features.points[first], features.normals[first])
    along = own.along(start[chosen] - own.points)
    # Only between samples: beyond the last of them the feature may end.
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along *= np.minimum(1.0, reach / np.where(length > 0.0, length, 1.0))
    return chosen, own.points + along


def _volumes(
    shape: Shape, grid: Grid, distance: Array, changed: Mask, numbers: Indices, positions: Array
) -> Array:
    """Volume of the shape nearest to each particle, (n,) [m^d]."""
    around = grid.near(changed, 1)
    own = np.zeros(grid.size)
    unaffected = np.flatnonzero(~around[numbers])
    own[numbers[unaffected]] = cell_shares(shape, grid, numbers[unaffected], distance)
    shares = own[numbers]
    tree = cKDTree(positions)
    cells = np.flatnonzero(around & (distance < grid.half_diagonal))
    for start in range(0, cells.size, _CELLS_AT_ONCE):
        found = finest_pieces(
            shape, grid.positions(cells[start : start + _CELLS_AT_ONCE]), grid.steps
        )
        shares += nearest(tree, found.points).sums(found.shares, tree.n)
    result: Array = shares * grid.cell_volume
    return result
