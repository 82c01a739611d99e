"""Particles on a lattice with a cell each, from which every lattice arrangement starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._checks import check_faces, refusal
from solidsph_builtin.discretisations._grid import Grid, in_chunks
from solidsph_builtin.discretisations._nearest import Assignment, nearest
from solidsph_builtin.discretisations._pieces import pieces
from solidsph_builtin.discretisations._surface import area_vectors, faces, mirrored, sampled, tags

# Lattice points this close to the boundary, in spacings, are on it.
_ON_BOUNDARY = 1e-9
# Cells that are halved at once, to bound the memory.
_CELLS_AT_ONCE = 4096


def lattice_particles(
    discretisation: Discretisation,
    shape: Shape,
    grid: Grid,
    spacing: float,
    *,
    ghosts: int,
    ghost_faces: Sequence[str] | None,
) -> Particles:
    """One particle at every lattice point in the shape, then the ghosts around them.

    Args:
        discretisation: the part that messages name.
        shape: the body.
        grid: the lattice, at least `ghosts` layers larger than the shape.
        spacing: as requested [m]; the particles have that of the grid.
        ghosts: layers of ghosts.
        ghost_faces: faces behind which there are ghosts; None for all.

    Raises:
        SceneError: no lattice point lies in the shape.
    """
    tolerance = _ON_BOUNDARY * float(grid.steps.min())
    distance = in_chunks(grid.size, lambda n: shape.signed_distance(grid.positions(n)))
    shares, real = _shares(shape, grid, distance, tolerance)
    numbers = np.flatnonzero(real)
    if not numbers.size:
        raise refusal(
            discretisation,
            f"no particle of the lattice with spacing {spacing:g} m lies inside the shape; use a "
            f"smaller spacing (the sides of its bounding box are {grid.lengths.tolist()} m)",
        )
    positions = grid.positions(numbers)
    tree = cKDTree(positions)

    volumes = grid.cell_volume * shares[numbers]
    orphans = np.flatnonzero(~real & (np.abs(distance) < grid.half_diagonal))
    volumes += _adopted(shape, grid, orphans, tree)
    volumes = fitted(volumes, grid.cell_volume, shape.volume())

    surface = sampled(discretisation, shape, spacing)
    owners = _owners(grid, real, tree, surface.points)

    ghost_numbers = np.flatnonzero(grid.near(real, ghosts) & ~real)
    ghost_positions = grid.positions(ghost_numbers)
    if ghost_faces is not None:
        check_faces(discretisation, ghost_faces, surface.faces)
    images, samples, kept = mirrored(shape, surface, ghost_positions, tolerance, ghost_faces)
    ghost_positions, images, samples = ghost_positions[kept], images[kept], samples[kept]
    cells = volumes
    if len(ghost_positions):
        occupied = real.copy()
        occupied[ghost_numbers[kept]] = True
        cells = np.maximum(volumes, grid.cell_volume * grid.completed(occupied)[numbers])
    count = numbers.size + len(ghost_positions)
    owned = faces(surface, owners, positions)
    is_ghost = np.arange(count) >= numbers.size
    everywhere = np.concatenate([positions, ghost_positions])
    return Particles(
        positions=everywhere,
        volumes=np.concatenate([volumes, np.full(len(ghost_positions), grid.cell_volume)]),
        spacings=np.full(count, mean_spacing(grid, spacing)),
        area_vectors=area_vectors(owned, count, shape.dimension),
        ghosts=is_ghost,
        images=np.concatenate([positions, images]) if len(images) else everywhere,
        tags=tags(owned, is_ghost, [surface.faces[sample] for sample in samples]),
        faces=owned,
        # A ghost has the weight in sums of the particle whose image it is.
        cells=np.concatenate([cells, cells[tree.query(images)[1]]]) if len(images) else cells,
    )


def mean_spacing(grid: Grid, wanted: float) -> float:
    """Spacing whose power d is the volume of a cell [m]; exactly `wanted` where it fits."""
    mean = float(grid.cell_volume ** (1.0 / len(grid.cells)))
    return wanted if np.allclose(grid.steps, wanted, rtol=1e-9, atol=0.0) else mean


def _shares(shape: Shape, grid: Grid, distance: Array, tolerance: float) -> tuple[Array, Mask]:
    """Share of the shape in the cell of each lattice point (size,) [-], and which points are
    particles (size,).

    A point on the boundary with a share of zero is no particle: it lies where a composite shape
    closes up, as on the face of a box minus a box with the same face.
    """
    inside = distance <= tolerance
    shares = np.zeros(grid.size)
    numbers = np.flatnonzero(inside)
    shares[numbers] = cell_shares(shape, grid, numbers, distance)
    return shares, inside & (shares > _ON_BOUNDARY)


def cell_shares(shape: Shape, grid: Grid, numbers: Indices, distance: Array) -> Array:
    """Share of the shape in the cell of each of these lattice points (n,) [-].

    `distance` (size,) [m] is that of all lattice points.
    """
    shares = np.ones(numbers.size)
    # A cell that the boundary does not reach is whole; only the others are divided.
    cut = np.flatnonzero(distance[numbers] > -grid.half_diagonal)
    for start in range(0, cut.size, _CELLS_AT_ONCE):
        some = cut[start : start + _CELLS_AT_ONCE]
        found = pieces(shape, grid.positions(numbers[some]), grid.steps)
        shares[some] = np.bincount(found.cells, weights=found.shares, minlength=some.size)
    return shares


def _adopted(shape: Shape, grid: Grid, orphans: Indices, tree: cKDTree) -> Array:
    """Volume of cells without a particle that is nearest to each particle, (n,) [m^d]."""
    adopted = np.zeros(tree.n)
    for start in range(0, orphans.size, _CELLS_AT_ONCE):
        centres = grid.positions(orphans[start : start + _CELLS_AT_ONCE])
        found = pieces(shape, centres, grid.steps)
        adopted += nearest(tree, found.points).sums(found.shares, tree.n)
    result: Array = adopted * grid.cell_volume
    return result


def fitted(volumes: Array, cell: float, total: float | None) -> Array:
    """Volumes scaled to the exact total, if that is known; those of whole cells do not change."""
    if total is None:
        return volumes
    cut = np.abs(volumes - cell) > 1e-12 * cell
    missing = total - float(volumes.sum())
    if abs(missing) <= 1e-13 * total:
        return volumes
    # If cut cells cannot take the difference, all cells share it.
    if abs(missing) > 0.5 * volumes[cut].sum():
        cut[:] = True
    scale = np.where(cut, 1.0 + missing / volumes[cut].sum(), 1.0)
    return np.asarray(volumes * scale)


def _owners(grid: Grid, real: Mask, tree: cKDTree, points: Array) -> Assignment:
    """The particles nearest to each of `points` (m, d)."""
    cells = grid.cell_of(points)
    # A particle is the nearest to all points in its cell: the tree is for other points only.
    own, elsewhere = np.flatnonzero(real[cells]), np.flatnonzero(~real[cells])
    others = nearest(tree, points[elsewhere])
    return Assignment(
        particles=np.concatenate([(np.cumsum(real) - 1)[cells[own]], others.particles]),
        points=np.concatenate([own, elsewhere[others.points]]),
        shares=np.concatenate([np.ones(own.size), others.shares]),
    )
