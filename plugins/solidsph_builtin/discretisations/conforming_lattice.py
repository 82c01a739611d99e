"""Conforming lattice: particles in rows and columns, the outermost moved onto the boundary."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._cells import cell_shares, fitted, mean_spacing
from solidsph_builtin.discretisations._checks import check_spacing, refusal
from solidsph_builtin.discretisations._features import Features, gap, meetings, smooth
from solidsph_builtin.discretisations._grid import Grid, grid_over, in_chunks
from solidsph_builtin.discretisations._nearest import nearest, thinned
from solidsph_builtin.discretisations._pieces import finest_pieces
from solidsph_builtin.discretisations._surface import area_vectors, faces, sampled, tags

# Closer than this, in cells, a point is on the boundary, or two are at the same place.
_AT = 1e-9
# Two particles on the boundary closer than this, in cells, become one.
_CLOSEST = 0.5
# The boundary is sampled so much more finely than the particles, in each dimension.
_FINER = {1: 1.0, 2: 4.0, 3: 2.0}
# Steps along the gradient of the distance, which halve what is left at the sharpest of corners.
_STEPS = 40
_CELLS_AT_ONCE = 1024


@final
@attrs.frozen
class ConformingLattice(Discretisation):
    """A lattice whose outermost particles lie on the boundary of any shape.

    It begins as a lattice with points on the faces of the bounding box. Every point whose cell
    the boundary crosses, from inside or outside, is moved to the place on the boundary nearest to
    it, or onto an edge or a corner in its cell: so each corner has a particle, also where an arc
    meets a straight line. Of those that come closer than half a spacing to each other, one stays.
    A box aligned with the axes has the particles of `lattice` with `on_boundary`.

    The volume of a particle is that part of the shape which is nearest to it; the total is exact
    where the shape knows its own. Particles come in the order of the lattice points. Tags: each
    face of the shape, `surface` and `interior`. There are no ghosts: behind a curved boundary
    they have no place of their own.
    """

    def particles(self, shape: Shape, spacing: float) -> Particles:
        """As in the interface.

        Raises:
            SceneError: the spacing is not positive, so large that no particle is left, or so
                small that there would be too many.
        """
        spacing = check_spacing(self, spacing)
        grid = grid_over(self, shape, spacing, on_boundary=True)
        distance = in_chunks(grid.size, lambda n: shape.signed_distance(grid.positions(n)))
        surface = sampled(self, shape, spacing)
        numbers, onto, positions, changed = _arranged(shape, grid, distance, spacing)
        if not numbers.size:
            raise refusal(
                self,
                f"no particle of the lattice with spacing {spacing:g} m belongs to the shape; use "
                f"a smaller spacing (its bounding box measures {grid.lengths.tolist()} m)",
            )
        volumes = fitted(
            _volumes(shape, grid, distance, changed, numbers, positions),
            grid.cell_volume,
            shape.volume(),
        )
        # What lies where a composite shape closes up belongs to no part of it.
        kept = volumes > _AT * grid.cell_volume
        positions, volumes, onto = positions[kept], volumes[kept], onto[kept]
        count = len(positions)
        outermost = np.flatnonzero(onto)
        owners = nearest(cKDTree(positions[outermost]), surface.points)
        own = faces(surface, attrs.evolve(owners, particles=outermost[owners.particles]))
        none = np.zeros(count, dtype=np.bool_)
        return Particles(
            positions=positions,
            volumes=volumes,
            spacings=np.full(count, mean_spacing(grid, spacing)),
            area_vectors=area_vectors(own, count, shape.dimension),
            ghosts=none,
            images=positions.copy(),
            tags=tags(own, none, ()),
            faces=own,
        )


def _arranged(
    shape: Shape, grid: Grid, distance: Array, spacing: float
) -> tuple[Indices, Mask, Array, Mask]:
    """Lattice points that are particles (n,), which are on the boundary (n,), where they are now
    (n, d) [m], and which points of the whole lattice are not where they were (size,)."""
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
    moved = _pulled(shape, surface, places, spacing)
    # What is on the boundary already, and keeps its place, does so to the last bit.
    still = np.abs((moved - start) / grid.steps).max(axis=1, initial=0.0) <= _AT
    moved[still] = start[still]

    way = np.round(np.linalg.norm((moved - start) / grid.steps, axis=1), 6)
    order = np.lexsort((crossed, ~inside[crossed], way, -rank))
    stays = thinned(moved / grid.steps, order, _CLOSEST * (1.0 - _AT))

    positions = grid.positions(np.arange(grid.size))
    positions[crossed] = moved
    onto = np.zeros(grid.size, dtype=np.bool_)
    onto[crossed[stays]] = True
    is_particle = inside.copy()
    is_particle[crossed] = stays
    changed = np.zeros(grid.size, dtype=np.bool_)
    changed[crossed] = ~still | ~stays
    numbers = np.flatnonzero(is_particle)
    return numbers, onto[numbers], positions[numbers], changed


def _feet(
    features: Features, grid: Grid, start: Array, reach: float, *, everywhere: bool
) -> tuple[Indices, Array]:
    """Which of the lattice points `start` (m, d) go onto the features, (k,), and where (k, d) [m].

    All do, or with `everywhere` false those in whose cell there is a feature.
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
    # Between samples only: beyond the last of them the feature may end.
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along *= np.minimum(1.0, reach / np.where(length > 0.0, length, 1.0))
    return chosen, own.points + along


def _pulled(shape: Shape, surface: Surface, points: Array, spacing: float) -> Array:
    """`points` (m, d) close to the boundary, brought onto it along the gradient of the distance."""
    d, tolerance = points.shape[1], 1e-14 * spacing
    points = points.copy()
    for _ in range(_STEPS):
        distance = shape.signed_distance(points)
        off = np.flatnonzero(np.abs(distance) > tolerance)
        if not off.size:
            return points
        # Across so little that beside an edge only the face that the point is off is seen.
        step = np.maximum(1e-3 * np.abs(distance[off]), 1e-9 * spacing)[:, None]
        slope = np.stack(
            [
                shape.signed_distance(points[off] + step * axis)
                - shape.signed_distance(points[off] - step * axis)
                for axis in np.eye(d)
            ],
            axis=1,
        )
        length = np.linalg.norm(slope, axis=1, keepdims=True)
        points[off] -= distance[off, None] * slope / np.where(length > 0.0, length, 1.0)
    distance = shape.signed_distance(points)
    lost = np.abs(distance) > _AT * spacing
    if lost.any():
        points[lost] = surface.points[cKDTree(surface.points).query(points[lost])[1]]
    return points


def _volumes(
    shape: Shape, grid: Grid, distance: Array, changed: Mask, numbers: Indices, positions: Array
) -> Array:
    """What part of the shape is nearest to each particle, (n,) [m^d]."""
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
