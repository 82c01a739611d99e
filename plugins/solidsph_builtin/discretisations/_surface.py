"""Data of particles from the surface of their shape: area vectors, tags, mirror images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Face, Particles
from solidsph_builtin.discretisations._checks import refusal
from solidsph_builtin.discretisations._nearest import Assignment

# Samples among which a ghost looks for its mirror: enough to reach round an edge.
_NEAREST = 8


def sampled(discretisation: Discretisation, shape: Shape, spacing: float) -> Surface:
    """The surface of `shape`, at most `spacing` [m] between samples.

    Raises:
        SceneError: there is none.
    """
    surface = shape.surface(spacing)
    if not surface.faces:
        raise refusal(discretisation, "the shape has no surface; is anything of it left?")
    return surface


def faces(surface: Surface, owners: Assignment, positions: Array) -> dict[str, Face]:
    """Area that each particle owns of each face, with a total that closes.

    Args:
        surface: samples of a closed surface.
        owners: the particles that own the samples.
        positions: of all particles (n, d) [m].
    """
    numbers = {name: number for number, name in enumerate(dict.fromkeys(surface.faces))}
    face_of = np.array([numbers[name] for name in surface.faces], dtype=np.intp)[owners.points]
    areas = surface.area_vectors[owners.points] * owners.shares[:, np.newaxis]
    # One key for each particle on each face: an outline may have a hundred thousand faces.
    count = int(owners.particles.max(initial=0)) + 1
    keys, which = np.unique(face_of * count + owners.particles, return_inverse=True)
    area_vectors = np.zeros((keys.size, surface.points.shape[1]))
    np.add.at(area_vectors, which, areas)
    lengths = np.zeros(keys.size)
    np.add.at(lengths, which, np.linalg.norm(areas, axis=1))
    arms = surface.points[owners.points] - positions[owners.particles]
    d = positions.shape[1]
    moments = np.zeros((keys.size, d, d))
    np.add.at(moments, which, areas[:, :, None] * arms[:, None, :])
    bounds = np.searchsorted(keys, count * np.arange(len(numbers) + 1)).tolist()
    found = {
        name: Face(keys[a:b] % count, area_vectors[a:b], lengths[a:b], moments[a:b])
        for name, a, b in zip(numbers, bounds[:-1], bounds[1:], strict=True)
    }

    return closed(found)


def closed(found: Mapping[str, Face]) -> dict[str, Face]:
    """Faces of a closed surface, their areas A changed so that they add up to zero.

    A uniform pressure over a closed surface must not push the body. Where a composite shape cuts
    through samples, their sum is off by about the size of a sample. So every area A is rescaled at
    constant normal n by the smallest changes that close the sum:

        A <- A (1 + n . l),    (sum |A| n n^T) l = -sum A
    """
    vectors = np.concatenate([face.area_vectors for face in found.values()])
    sizes = np.linalg.norm(vectors, axis=1)
    residual = vectors.sum(axis=0)
    # Rounding alone is left as it is, so that plane faces keep their exact areas.
    if np.linalg.norm(residual) <= 1e-13 * sizes.sum():
        return dict(found)
    # A face folded within one particle may leave it no area, and then no normal.
    normals = vectors / np.where(sizes > 0.0, sizes, 1.0)[:, np.newaxis]
    change = np.linalg.lstsq(vectors.T @ normals, -residual)[0]
    rescaled = np.split(
        vectors * (1.0 + normals @ change)[:, np.newaxis],
        np.cumsum([face.particles.size for face in found.values()])[:-1],
    )
    return {
        name: attrs.evolve(face, area_vectors=own)
        for (name, face), own in zip(found.items(), rescaled, strict=True)
    }


def area_vectors(faces: Mapping[str, Face], count: int, dimension: int) -> Array:
    """Area vector of each of `count` particles on all `faces`, (count, d) [m^(d-1)]."""
    total = np.zeros((count, dimension))
    for face in faces.values():
        total[face.particles] += face.area_vectors
    return total


def tags(faces: Mapping[str, Face], ghosts: Mask, nearest_faces: Sequence[str]) -> dict[str, Mask]:
    """Named sets of particles, each (n,).

    Args:
        faces: the particles on each face.
        ghosts: (n,) which particles are ghosts.
        nearest_faces: (number of ghosts,) the face nearest to each of them.
    """
    found = {face: _mask(len(ghosts), own.particles) for face, own in faces.items()}
    surface = _mask(len(ghosts), np.concatenate([own.particles for own in faces.values()]))
    if ghosts.any():
        names, numbers = np.array(nearest_faces), np.flatnonzero(ghosts)
        found |= {f"{face}-ghosts": _mask(len(ghosts), numbers[names == face]) for face in faces}
    return {**found, "surface": surface, "interior": ~surface & ~ghosts, "ghosts": ghosts}


def without_ghosts(
    positions: Array, volumes: Array, spacing: Array | float, faces: Mapping[str, Face]
) -> Particles:
    """Particles at `positions` (n, d), their own images, that own these `faces`.

    Args:
        positions: of the particles [m].
        volumes: (n,) [m^d].
        spacing: that they are said to have, (n,) or one [m].
        faces: the particles on each face.
    """
    count, d = positions.shape
    none = np.zeros(count, dtype=np.bool_)
    return Particles(
        positions=positions,
        volumes=volumes,
        spacings=np.full(count, spacing),
        area_vectors=area_vectors(faces, count, d),
        ghosts=none,
        images=positions.copy(),
        tags=tags(faces, none, ()),
        faces=faces,
    )


def _mask(count: int, members: Indices) -> Mask:
    mask = np.zeros(count, dtype=np.bool_)
    mask[members] = True
    return mask


def mirrored(
    shape: Shape, surface: Surface, points: Array, tolerance: float, allowed: Sequence[str] | None
) -> tuple[Array, Indices, Mask]:
    """Mirror images of `points` (n, d) [m], the sample of the surface nearest to each (n,), and
    whether all its mirrors lie on `allowed` faces (n,), any face if None.

    The mirror is the plane through the nearest sample. Beyond an edge or a corner an image may
    still lie outside; it is then mirrored again, at most once for each dimension.
    """
    images, samples = points.copy(), np.zeros(len(points), dtype=np.intp)
    kept = np.ones(len(points), dtype=np.bool_)
    if not len(points):
        return images, samples, kept
    is_mirror = np.array([allowed is None or face in allowed for face in surface.faces])
    tree = cKDTree(surface.points)
    normals = surface.area_vectors / np.linalg.norm(surface.area_vectors, axis=1, keepdims=True)
    outside = np.arange(len(points))
    for mirror in range(2 * points.shape[1]):
        if not outside.size:
            break
        nearest, gaps = _in_front(tree, surface.points, normals, images[outside])
        if mirror == 0:
            samples = nearest
        kept[outside] &= is_mirror[nearest]
        images[outside] -= 2.0 * gaps[:, np.newaxis] * normals[nearest]
        outside = outside[shape.signed_distance(images[outside]) > tolerance]
    return images, samples, kept


def _in_front(
    tree: cKDTree, samples: Array, normals: Array, points: Array
) -> tuple[Indices, Array]:
    """The nearest sample that each of `points` is in front of (n,), and how far (n,) [m].

    Beyond an edge the nearest of all may lie on a face that the point is behind or beside.
    """
    count = min(_NEAREST, len(samples))
    near = np.asarray(tree.query(points, k=np.arange(1, count + 1))[1], dtype=np.intp)
    gaps = np.einsum("nki,nki->nk", points[:, np.newaxis, :] - samples[near], normals[near])
    rows = np.arange(len(points))
    # The first that is clearly in front; the nearest where none is.
    chosen = np.argmax(gaps > 1e-6 * np.abs(gaps).max(axis=1, keepdims=True), axis=1)
    return near[rows, chosen], gaps[rows, chosen]
