"""Checks of a shape: its distance, its boundary and its volume must agree.

A point is inside if it sees the sampled boundary under the full solid angle. That does not use the
distance, so it can check its sign.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from solidsph.conformance.check import Broken, Kit, NotPromised, Verdict, at_most
from solidsph.interfaces.shape import Shape, Surface
from solidsph.interfaces.smoothing_kernel import UNIT_SPHERE
from solidsph.maths.arrays import Array

# Samples along the longest side: their spacing is the error that a sampled boundary may have.
_ALONG = {1: 20, 2: 200, 3: 40}

# Points along each axis where a volume is counted: of those beside the boundary half are wrong.
_POINTS = {1: 2000, 2: 300, 3: 60}

# A boundary sampled exactly, at whatever spacing: sums over some thousand samples.
_ROUNDING = 1e-12

# Of the spacing: the error of a point on the boundary by rounding and a solver's tolerance.
_ON_BOUNDARY = 1e-6

KIT = Kit()


def _size(shape: Shape) -> float:
    lower, upper = shape.bounds()
    return float((upper - lower).max())


def _spacing(shape: Shape) -> float:
    return _size(shape) / _ALONG[shape.dimension]


def _sampled(shape: Shape) -> Surface:
    return shape.surface(_spacing(shape))


def _areas(surface: Surface) -> Array:
    return np.asarray(np.linalg.norm(surface.area_vectors, axis=1))


@KIT.check
def arrays(shape: Shape) -> Verdict:
    """Bounds, distances and samples are finite arrays in the declared dimension, 1 to 3."""
    d = shape.dimension
    if d not in (1, 2, 3):
        raise Broken(f"declares dimension {d}")
    lower, upper = shape.bounds()
    surface = _sampled(shape)
    count = len(surface.points)
    probes = np.stack([lower, upper, 0.5 * (lower + upper)])
    expected = {
        "bounds": (np.stack([lower, upper]), (2, d)),
        "signed_distance": (shape.signed_distance(probes), (3,)),
        "points": (surface.points, (count, d)),
        "area_vectors": (surface.area_vectors, (count, d)),
    }
    for name, (array, wanted) in expected.items():
        if np.shape(array) != wanted or not np.all(np.isfinite(array)):
            raise Broken(f"{name} {np.shape(array)}, not {wanted}, or not finite")
    return Verdict(bool(np.all(upper > lower)), f"{d}D, {count} samples")


@KIT.check
def bounds(shape: Shape) -> Verdict:
    """The bounds hold the whole boundary, and no point outside them is inside the shape."""
    lower, upper = shape.bounds()
    points = _sampled(shape).points
    beyond = max(float((lower - points).max()), float((points - upper).max())) / _size(shape)
    if beyond > _ROUNDING:
        raise Broken(f"the boundary exceeds them by {beyond:.1e} of the size")
    probes = _around(shape)
    outside = np.any((probes < lower) | (probes > upper), axis=1)
    inside = int(np.sum(shape.signed_distance(probes[outside]) < 0.0))
    return Verdict(inside == 0, f"{inside} of {int(outside.sum())} points outside are inside")


@KIT.check
def closed_boundary(shape: Shape) -> Verdict:
    """The boundary is closed: its area vectors add up to zero, up to a sample where two parts of a
    composite shape cross."""
    surface = _sampled(shape)
    error = float(np.abs(surface.area_vectors.sum(axis=0)).max() / _areas(surface).sum())
    return at_most(error, _of_areas(shape))


@KIT.check
def volume(shape: Shape) -> Verdict:
    """The volume is what the boundary encloses by the divergence theorem; where no closed form is
    known, that of the points inside."""
    surface = _sampled(shape)
    known = shape.volume()
    limit = _ALONG[shape.dimension] ** -2.0
    if known is None:
        # By the points of a lattice that are inside, where the distance is negative.
        known, limit = _counted(shape), 4.0 / _POINTS[shape.dimension]
    # From the middle, where rounding is least.
    middle = 0.5 * np.sum(shape.bounds(), axis=0)
    flux = float(np.vdot(surface.points - middle, surface.area_vectors)) / shape.dimension
    # Samples in the middle of their part of a curved face err by the square of their spacing.
    return at_most(abs(flux / known - 1.0), limit)


@KIT.errors(_ON_BOUNDARY)
def on_boundary(shape: Shape) -> Iterator[float]:
    """The distance of the samples of the boundary is zero."""
    distances = np.abs(shape.signed_distance(_sampled(shape).points))
    yield float(distances.max()) / _spacing(shape)


# A curved face bends away by the square of the step.
@KIT.errors(1e-2)
def distance_near_boundary(shape: Shape) -> Iterator[float]:
    """A small step along the outward normal changes the distance by the step, away from corners:
    for nine samples in ten."""
    surface = _sampled(shape)
    step = 1e-3 * _spacing(shape)
    normals = surface.area_vectors / _areas(surface)[:, None]
    errors = [
        np.abs(shape.signed_distance(surface.points + sign * step * normals) / (sign * step) - 1.0)
        for sign in (-1.0, 1.0)
    ]
    yield float(np.quantile(np.maximum(*errors), 0.9))


@KIT.errors(_ROUNDING)
def distance_elsewhere(shape: Shape) -> Iterator[float]:
    """Nowhere is the distance larger than that to the nearest sample of the boundary."""
    probes, points = _around(shape), _sampled(shape).points
    nearest = np.asarray(cKDTree(points).query(probes)[0])
    yield float((np.abs(shape.signed_distance(probes)) - nearest).max()) / _size(shape)


@KIT.check
def sign(shape: Shape) -> Verdict:
    """The distance is negative inside and positive outside, everywhere."""
    probes, h = _around(shape), _spacing(shape)
    surface = _sampled(shape)
    d = shape.dimension
    distances = shape.signed_distance(probes)
    wrong = known = 0
    for probe, distance in zip(probes, distances, strict=True):
        offsets = surface.points - probe
        r = np.linalg.norm(offsets, axis=1)
        if r.min() < 2.0 * h:  # so near, the samples do not add up to a surface
            continue
        angle = float(np.sum(np.sum(surface.area_vectors * offsets, axis=1) / r**d))
        known += 1
        wrong += (angle / UNIT_SPHERE[d] > 0.5) != (distance < 0.0)
    return Verdict(wrong == 0 and known > 0, f"{wrong} of {known} points on the wrong side")


@KIT.errors(_ROUNDING)
def distance_bound(shape: Shape) -> Iterator[float]:
    """Between two points the distance changes by no more than their distance from each other."""
    probes = _around(shape)
    distances = shape.signed_distance(probes)
    apart = np.linalg.norm(probes[:, None] - probes[None], axis=2)
    excess = float((np.abs(distances[:, None] - distances[None]) - apart).max())
    yield max(0.0, excess) / _size(shape)


@KIT.errors(_ROUNDING)
def convex_lines(shape: Shape) -> Iterator[float]:
    """In a shape declared as convex, no line between two points inside leaves it."""
    if not shape.convex:
        raise NotPromised("it is not declared as convex")
    probes = _around(shape)
    inside = probes[shape.signed_distance(probes) < 0.0]
    between = [t * inside[:, None] + (1.0 - t) * inside[None] for t in (0.25, 0.5)]
    points = np.concatenate(between).reshape(-1, shape.dimension)
    yield float(shape.signed_distance(points).max()) / _size(shape)


@KIT.errors(1.0 + _ROUNDING)
def sampling(shape: Shape) -> Iterator[float]:
    """Samples are at most the given spacing apart: none has an area above spacing^(d-1)."""
    # In 1D the boundary is points, of area 1 each.
    for h in (_spacing(shape), 3.0 * _spacing(shape)):
        yield float(_areas(shape.surface(h)).max()) / h ** (shape.dimension - 1)


@KIT.check
def named_faces(shape: Shape) -> Verdict:
    """Each sample lies on a named face; the names and the areas of faces do not depend on the
    spacing of the samples."""
    first, second = (_faces(shape.surface(k * _spacing(shape))) for k in (1.0, 2.0))
    if set(first) != set(second) or not all(isinstance(n, str) and n for n in first):
        raise Broken(f"{sorted(first)} and {sorted(second)}")
    error = max(abs(first[name] - second[name]) for name in first) / sum(first.values())
    return at_most(error, _of_areas(shape))


def _counted(shape: Shape) -> float:
    """Volume by the points of a lattice that are inside [m^d]."""
    lower, upper = shape.bounds()
    count = _POINTS[shape.dimension]
    axes = [
        a + (np.arange(count) + 0.5) / count * (b - a) for a, b in zip(lower, upper, strict=True)
    ]
    points = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    inside = np.mean(shape.signed_distance(points) < 0.0)
    return float(inside * np.prod(upper - lower))


def _of_areas(shape: Shape) -> float:
    """Tolerance of sums of areas, over the whole area."""
    # Where two parts of a composite shape cross, two samples on either side belong to either part.
    return _ROUNDING if shape.volume() is not None else 4.0 / _ALONG[shape.dimension]


def _around(shape: Shape) -> Array:
    """Points in and around the bounds, (m, d), the same in every run [m]."""
    lower, upper = shape.bounds()
    margin = 0.3 * (upper - lower)
    noise = np.random.default_rng(0).uniform(size=(400, shape.dimension))
    return np.asarray(lower - margin + noise * (upper - lower + 2.0 * margin))


def _faces(surface: Surface) -> dict[str, float]:
    """Area of every face by name [m^(d-1)]."""
    if len(surface.faces) != len(surface.points):
        raise ValueError(f"{len(surface.faces)} faces for {len(surface.points)} samples")
    names, areas = np.array(surface.faces), _areas(surface)
    return {name: float(areas[names == name].sum()) for name in sorted(set(surface.faces))}
