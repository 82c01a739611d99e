"""Volumes and areas of particles that integrate polynomials of the second degree.

The volume of a particle is the integral of the function that it has in a moving least squares fit
(`_reproducing.py`), and its area is that over the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product
from math import ceil, sqrt

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array, Mask
from solidsph.model.particles import Face, Particles
from solidsph.system.build_log import BUILD
from solidsph_builtin.discretisations._checks import refusal
from solidsph_builtin.discretisations._grid import Grid, grid_over, in_chunks
from solidsph_builtin.discretisations._pieces import finest_pieces
from solidsph_builtin.discretisations._reproducing import Fit
from solidsph_builtin.discretisations._sampled_once import sampled_once
from solidsph_builtin.discretisations._surface import area_vectors, sampled

FINER = {1: 1.0, 2: 4.0, 3: 1.0}
"""Samples of the surface along a spacing, over those that an assignment to particles needs, by
dimension."""

HALVINGS = {1: 3, 2: 3, 3: 2}
"""How often a cell that the surface cuts is halved, by dimension."""

ON_BOUNDARY = 1e-6
"""Particles this close to the boundary, in spacings, are on it."""

# Weight of a particle on the surface in fits to neighbours, in cells; on a plane such a particle
# stands for 3/8 of one. With 8 particles across, the radial stress in a ring is off by 2.8 % with
# 0.5, by 2.1 % with 0.375, by 1.9 % with 1/3, by 1.7 % with 0.3, and the peak beside a hole with
# 20 particles a side by -4.5 to -5.0 %. Fitted volumes as weights are too uneven on surfaces in
# space; inside they are the weights, with which sums of the kernel are 1 to 1 % where particles are
# crowded, as in small balls. Where the spacing varies, a uniform stress in a cube of 492 particles
# balanced to 1.5e-4 of the loads with volumes as weights everywhere.
_ON_SURFACE = 1.0 / 3.0

# Particles along a face for functions of its own.
_ENOUGH_ALONG = 4

# Particles on a face are no further than this from the tangent plane of the nearest sample, in
# spacings: half a sample along a curve, but not half a spacing down another face.
_ABOVE = 0.15

# Moments that differ by less, as parts of the volume, are those of the body, and volumes are alike.
_ROUNDING = 1e-12

# Part of its volume that no particle loses for the sake of the moments; where one were to lose much
# more, the surface is not that of the body.
_MOST_LOST, _ABSURD = 0.5, 2.0

# Gauss's rule with two points, in cells from the middle.
_GAUSS = 0.5 / sqrt(3.0)

_CELLS_AT_ONCE = 4096


def fitted(
    discretisation: Discretisation,
    shape: Shape,
    spacing: float,
    given: Particles,
    disturbed: float = 0.0,
) -> Particles:
    """`given` particles with fitted volumes and, if all their owners are on it, a fitted surface.

    Args:
        discretisation: the part that messages name.
        shape: the body.
        spacing: of the particles [m].
        given: particles, whose tags stay; those deep inside keep their volumes.
        disturbed: depth to which the particles are no lattice [m].

    Raises:
        SceneError: a volume would not be positive.
    """
    shape, real = sampled_once(shape), ~given.ghosts
    X, volumes = given.positions, given.volumes.copy()
    BUILD.debug("volumes of %d", given.count)
    volumes[real] = fitted_volumes(
        discretisation, shape, spacing, X[real], volumes[real], disturbed
    )
    if not np.all(volumes > 0.0):
        raise refusal(
            discretisation,
            f"the body is too thin for the spacing {spacing:g} m: a particle would have the volume "
            f"{volumes.min():.3g} m^{shape.dimension}; use a finer spacing, or another "
            "discretisation, such as 'conforming-lattice'",
        )
    BUILD.debug("areas on the surface")
    faces = given.faces
    owners = np.unique(np.concatenate([face.particles for face in faces.values()]))
    # Areas of particles inside are those of whom the surface is nearest to.
    if np.abs(shape.signed_distance(X[owners])).max(initial=0.0) <= ON_BOUNDARY * spacing:
        faces = fitted_faces(discretisation, shape, spacing, X, faces)
        faces = agreeing(faces, X[real], volumes[real])
    areas = area_vectors(faces, given.count, shape.dimension)
    return attrs.evolve(given, volumes=volumes, faces=faces, area_vectors=areas)


def lighter_on_surface(given: Particles, shape: Shape) -> Particles:
    """`given` particles that weigh a part of a cell in sums over neighbours where they are on the
    surface, and their volumes inside."""
    # Further than two spacings is far enough to know, and quick.
    distance = shape.distance_within(given.positions, 2.0 * float(given.spacings.max()))
    onto = np.abs(distance) <= ON_BOUNDARY * given.spacings
    cells = np.where(onto, _ON_SURFACE * given.spacings**shape.dimension, given.volumes)
    return attrs.evolve(given, cells=cells)


def fitted_volumes(
    discretisation: Discretisation,
    shape: Shape,
    spacing: float,
    positions: Array,
    volumes: Array,
    disturbed: float = 0.0,
) -> Array:
    """Integrals of the functions of the particles, (n,) [m^d].

    What curved surfaces leave of the body's volume, centre and second moments is corrected by the
    smallest relative change.

    Args:
        discretisation: the part that messages name.
        shape: the body.
        spacing: of the particles [m].
        positions: of the particles, (n, d) [m].
        volumes: that particles deep inside keep, (n,) [m^d].
        disturbed: depth to which the particles are no lattice [m].
    """
    fit = Fit(positions, spacing, _lattice_of(discretisation, shape, spacing, positions))
    # The function of a particle further inside meets complete neighbourhoods only.
    depth = disturbed + 2.0 * fit.reach
    grid = grid_over(discretisation, shape, spacing)
    near = _near_surface(shape, spacing, grid, depth)[grid.cell_of(positions)]
    points, weights = _quadrature(shape, spacing, grid, depth + fit.reach)
    integrated = fit.positive_integrals(points, weights, near)
    changed = near & (np.abs(integrated - volumes) > _ROUNDING * volumes)
    return with_moments(positions, np.where(changed, integrated, volumes), near, shape, spacing)


def _near_surface(shape: Shape, spacing: float, grid: Grid, depth: float) -> Mask:
    """Which cells of a `grid` are at most so far from those of the surface [m], (size,)."""
    marked = np.zeros(grid.size, dtype=np.bool_)
    marked[grid.cell_of(shape.surface(spacing).points)] = True
    return grid.near(marked, ceil(depth / float(grid.steps.min())))


def _lattice_of(
    discretisation: Discretisation, shape: Shape, spacing: float, positions: Array
) -> Grid:
    """The lattice over the shape, with points on its faces or half a cell inside, that has more of
    the particles."""
    grids = [
        grid_over(discretisation, shape, spacing, on_boundary=on_boundary)
        for on_boundary in (True, False)
    ]
    return max(grids, key=lambda grid: int(np.sum(grid.has(positions))))


def _quadrature(shape: Shape, spacing: float, grid: Grid, depth: float) -> tuple[Array, Array]:
    """Points (m, d) [m] and weights (m,) [m^d] of integrals over `shape`, to a depth [m]."""
    reach = 2.0 * grid.half_diagonal
    distance = in_chunks(grid.size, lambda n: shape.distance_within(grid.positions(n), reach))
    near = (distance < grid.half_diagonal) & _near_surface(shape, spacing, grid, depth)
    cut = np.flatnonzero(near & (distance > -grid.half_diagonal))
    whole = np.flatnonzero(near & (distance <= -grid.half_diagonal))
    points, weights = [], []
    for start in range(0, cut.size, _CELLS_AT_ONCE):
        some = cut[start : start + _CELLS_AT_ONCE]
        found = finest_pieces(shape, grid.positions(some), grid.steps, HALVINGS[shape.dimension])
        full = np.bincount(found.cells, found.shares, minlength=some.size) == 1.0
        whole = np.concatenate([whole, some[full]])
        parts = ~full[found.cells]
        points.append(found.points[parts])
        weights.append(found.shares[parts])
    gauss = gauss_points(shape.dimension) * grid.steps
    points.append((grid.positions(whole)[:, None, :] + gauss).reshape(-1, shape.dimension))
    weights.append(np.full(len(points[-1]), 1.0 / len(gauss)))
    return np.concatenate(points), grid.cell_volume * np.concatenate(weights)


def gauss_points(dimension: int) -> Array:
    """Points of Gauss's rule in a cell of size 1 about the origin, (2^d, d)."""
    return np.array(list(product((-_GAUSS, _GAUSS), repeat=dimension)))


def fitted_faces(
    discretisation: Discretisation,
    shape: Shape,
    spacing: float,
    positions: Array,
    given: Mapping[str, Face],
) -> dict[str, Face]:
    """Faces with areas and moments that are integrals of functions of the particles on them.

    All particles of the `given` faces must lie on the surface. The functions on a face are those of
    the particles on it, where they are enough: a particle beside it that owned a part of the face
    would be pushed as that part is, but not held as the face is by a plane of symmetry. Those on
    smaller faces, such as the sides of an outline, are of the whole surface.
    """
    surface = sampled(discretisation, shape, spacing / FINER[shape.dimension])
    grid = _lattice_of(discretisation, shape, spacing, positions)
    spacings = np.full(len(positions), spacing)
    return faces_by(surface, positions, spacings, given, lambda X: Fit(X, spacing, grid))


def faces_by(
    surface: Surface,
    positions: Array,
    spacings: Array,
    given: Mapping[str, Face],
    fit_of: Callable[[Array], Fit],
) -> dict[str, Face]:
    """Faces by samples of the surface, with the functions that `fit_of` makes of particles (k, d).

    The particles are at `positions` (n, d), with their `spacings` (n,) [m].
    """
    d = positions.shape[1]
    names = np.array(surface.faces)
    outer = np.unique(np.concatenate([face.particles for face in given.values()]))
    faces = {}
    for name, face in given.items():
        samples = np.flatnonzero(names == name)
        points, area = surface.points[samples], surface.area_vectors[samples]
        own = face.particles
        owners = own[_on_face(positions[own], points, area, spacings[own])]
        if len(owners) < _ENOUGH_ALONG ** (d - 1):
            owners = outer
        X = positions[owners]
        # About the middle, so that rounding is that of the face's own size.
        middle = points.mean(axis=0)
        x = points - middle
        products = (area[:, :, None] * x[:, None, :]).reshape(len(x), d * d)
        sizes = np.linalg.norm(area, axis=1)
        weights = np.column_stack([area, products, sizes])
        found = fit_of(X).integrals(points, weights)
        some = np.flatnonzero(np.abs(found[:, -1]) > _ROUNDING * np.abs(found[:, -1]).max())
        vectors, about_middle = found[some, :d], found[some, d:-1].reshape(-1, d, d)
        moments = about_middle - vectors[:, :, None] * (X[some] - middle)[:, None, :]
        faces[name] = Face(owners[some], vectors, found[some, -1], moments)
    return faces


def _on_face(positions: Array, points: Array, areas: Array, spacings: Array) -> Mask:
    """Which of the particles at `positions` (n, d) are on a face with samples at `points` (m, d),
    whose area vectors are `areas` (m, d), by their `spacings` (n,) [m], (n,)."""
    nearest = cKDTree(points).query(positions)[1]
    normals = areas[nearest] / np.linalg.norm(areas[nearest], axis=1, keepdims=True)
    above = np.einsum("ni,ni->n", positions - points[nearest], normals)
    return np.asarray(np.abs(above) < _ABOVE * spacings, dtype=np.bool_)


def agreeing(faces: Mapping[str, Face], positions: Array, volumes: Array) -> dict[str, Face]:
    """Faces with areas scaled so that the divergence theorem holds for polynomials.

    The sum of f(X) A over the surface is that of V grad f over the body, for all f of the second
    degree. So a uniform stress is in balance with its loads, to the last digit. Areas change by the
    least relative amounts, and keep their direction.
    """
    owners = np.concatenate([face.particles for face in faces.values()])
    vectors = np.concatenate([face.area_vectors for face in faces.values()])
    sizes = np.concatenate([np.abs(face.areas) for face in faces.values()])
    d = positions.shape[1]
    f, _, scale = _quadratics(positions, volumes)
    X = f[:, 1 : 1 + d]
    slopes = np.zeros((f.shape[1], d))
    slopes[1 : 1 + d] = np.eye(d) * volumes.sum()
    for row, (i, j) in enumerate(zip(*np.triu_indices(d), strict=True), start=1 + d):
        slopes[row, i] += volumes @ X[:, j]
        slopes[row, j] += volumes @ X[:, i]
    sums = (f[owners, :, None] * vectors[:, None, :]).reshape(len(owners), -1)
    missing = (slopes / scale).ravel() - sums.sum(axis=0)
    if np.abs(missing).max() <= _ROUNDING * sizes.sum():
        return dict(faces)
    # By a change c of each area, with the least sum of |A| c^2.
    scaled = sums / np.sqrt(sizes)[:, None]
    change = np.linalg.lstsq(scaled.T, missing, rcond=1e-8)[0] / np.sqrt(sizes)
    parts = np.split(1.0 + change, np.cumsum([face.particles.size for face in faces.values()])[:-1])
    return {
        name: Face(
            face.particles,
            face.area_vectors * part[:, None],
            face.areas * part,
            face.moments * part[:, None, None],
        )
        for (name, face), part in zip(faces.items(), parts, strict=True)
    }


def _quadratics(positions: Array, volumes: Array) -> tuple[Array, Array, float]:
    """1, x_i and x_i x_j (i <= j) at the particles (n, k), with x about the centre (d,) [m] and in
    units of the size [m], so that equations are well scaled."""
    centre = volumes @ positions / volumes.sum()
    scale = float(np.abs(positions - centre).max()) or 1.0
    x = (positions - centre) / scale
    upper = np.triu_indices(positions.shape[1])
    return np.hstack([np.ones((len(x), 1)), x, x[:, upper[0]] * x[:, upper[1]]]), centre, scale


def with_moments(
    positions: Array, volumes: Array, near: Mask, shape: Shape, spacing: float
) -> Array:
    """Volumes (n,) of particles at `positions` (n, d) with the moments of `shape` up to the second.

    The smallest relative change of `volumes` (n,) `near` the surface (n,) that corrects them is
    V <- V (1 + a + b . X + X . C X). `spacing` [m] is that of the particles; samples of the surface
    are finer.
    """
    d = positions.shape[1]
    basis, centre, scale = _quadratics(positions, volumes)
    missing = _moments(shape, centre, scale, spacing / FINER[d]) - volumes @ basis
    if np.abs(missing).max() <= _ROUNDING * volumes.sum():
        return volumes
    free = np.where(near, volumes, 0.0)
    # Volume and centre first, then second moments by what is left of their functions, which is
    # zero along a direction with one or two layers of particles.
    change = free * _change(basis[:, : 1 + d], free, missing[: 1 + d])
    gram = basis[:, : 1 + d].T @ (free[:, None] * basis[:, : 1 + d])
    along = np.linalg.lstsq(gram, basis[:, : 1 + d].T @ (free[:, None] * basis[:, 1 + d :]))[0]
    rest = basis[:, 1 + d :] - basis[:, : 1 + d] @ along
    left = missing[1 + d :] - change @ basis[:, 1 + d :]
    change += free * _change(rest, free, left)
    lost = float(np.max(-change / volumes))
    if _MOST_LOST < lost < _ABSURD:
        # In a body of few particles the change is too much for one of them, and is made in part.
        change *= _MOST_LOST / lost
    result: Array = volumes + change
    return result


def _change(functions: Array, volumes: Array, missing: Array) -> Array:
    """The smallest relative change (n,) of the volumes that adds `missing` (k,) to the sums of
    `functions` (n, k), as far as any change can."""
    gram = functions.T @ (volumes[:, None] * functions)
    change: Array = functions @ np.linalg.lstsq(gram, missing, rcond=1e-10)[0]
    return change


def _moments(shape: Shape, centre: Array, scale: float, spacing: float) -> Array:
    """Integrals of 1, x_i and x_i x_j (i <= j) over the shape, x scaled about the centre [m^d].

    By the divergence theorem where the shape does not know them: a function f of degree k has
    div(f x) = (d + k) f.
    """
    known, upper = shape.moments(centre), np.triu_indices(shape.dimension)
    if known is not None:
        second = known.second[upper] / scale**2
        return np.concatenate([[known.volume], known.first / scale, second])
    surface = shape.surface(spacing)
    x = (surface.points - centre) / scale
    d = x.shape[1]
    sizes = np.linalg.norm(surface.area_vectors, axis=1)
    normals = surface.area_vectors / sizes[:, None]
    flux = np.sum(x * surface.area_vectors, axis=1) * scale
    # A sample is an edge or a square, with a second moment about its own middle.
    edges = sizes ** (2.0 / max(d - 1, 1)) / scale**2 if d > 1 else np.zeros(len(x))
    own = (np.eye(d) - normals[:, :, None] * normals[:, None, :]) * edges[:, None, None] / 12.0
    second = x[:, upper[0]] * x[:, upper[1]] + own[:, upper[0], upper[1]]
    return np.concatenate([[flux.sum() / d], flux @ x / (d + 1), flux @ second / (d + 2)])
