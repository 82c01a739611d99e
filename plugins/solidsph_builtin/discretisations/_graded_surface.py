"""Particles on the surface of a body in space, as far apart as a spacing that varies says."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph.model.pair_search import PairSearch
from solidsph.model.spacing import SpacingField
from solidsph_builtin.discretisations._curves import graded_steps
from solidsph_builtin.discretisations._features import gap, meetings, smooth
from solidsph_builtin.discretisations._feet import on_boundary
from solidsph_builtin.discretisations._graded_relaxation import relaxed_by
from solidsph_builtin.discretisations._graded_samples import graded_samples
from solidsph_builtin.discretisations._nearest import thinned_pairs

# Samples along the least spacing, of the four that a shape makes.
_SAMPLES = 2.0
# Places on faces to choose from are a quarter to half of a spacing apart.
_CANDIDATES = 0.5
# Samples follow each other along an edge up to this distance, in gaps between them.
_NEXT = 2.5
# Places closer than this, in spacings, are one; of those on faces a random choice with this
# distance has one in the square of a spacing.
_CLOSEST = 0.84
# Samples closer to a corner than this, in gaps, are left out: edges that meet at an angle of 50
# degrees or more are then apart.
_AT_CORNER = 3.0
_STEPS = 60


def surface_points(discretisation: Discretisation, shape: Shape, spacing: SpacingField) -> Array:
    """Particles on corners, on edges in even steps, and on faces, (m, 3) [m]."""
    surface = shape.surface(spacing.least * 4.0 / _SAMPLES)
    reach = gap(surface)
    edges = meetings(smooth(surface), reach)
    corners = meetings(edges, reach).points if len(edges.points) else edges.points
    rows = [corners]
    for line, closed in _chains(edges.points, corners, reach):
        rows.append(graded_steps(line, spacing, closed=closed))
    fixed = _distinct(np.concatenate(rows), spacing)
    fixed = on_boundary(shape, surface, fixed, spacing.least) if len(fixed) else fixed
    candidates = graded_samples(discretisation, shape, spacing, _CANDIDATES)
    points = np.concatenate([fixed, _shuffled(candidates)])
    s = spacing.at(points)
    near = PairSearch.of(points, _CLOSEST * s).near(np.arange(len(points)))
    pairs = np.column_stack(near)
    stays = thinned_pairs(pairs[pairs[:, 0] < pairs[:, 1]], np.arange(len(points)))
    stays[: len(fixed)] = True
    points, free = points[stays], np.flatnonzero(stays) >= len(fixed)

    def onto(moved: Array) -> Array:
        return on_boundary(shape, surface, moved, spacing.least)

    points[free] = onto(points[free])
    return relaxed_by(points, free, spacing.at, _STEPS, onto)


def _shuffled(surface: Surface) -> Array:
    """The samples in an order without a pattern, always the same."""
    order = np.random.default_rng(0).permutation(len(surface.points))
    return np.asarray(surface.points[order])


def _distinct(points: Array, spacing: SpacingField) -> Array:
    """`points` (m, d) without those that an earlier one is close to."""
    if not len(points):
        return points
    near = PairSearch.of(points, 0.4 * spacing.at(points)).near(np.arange(len(points)))
    pairs = np.column_stack(near)
    return points[thinned_pairs(pairs[pairs[:, 0] < pairs[:, 1]], np.arange(len(points)))]


def _chains(points: Array, corners: Array, reach: float) -> list[tuple[Array, bool]]:
    """Samples of each edge in their order, from corner to corner, and whether it is closed."""
    if not len(points):
        return []
    if len(corners):
        away, _ = cKDTree(corners).query(points)
        points = points[away > _AT_CORNER * reach]
    found = cKDTree(points).query_pairs(_NEXT * reach, output_type="ndarray")
    lengths = np.linalg.norm(points[found[:, 1]] - points[found[:, 0]], axis=1)
    graph = csr_array(coo_array((lengths, found.T), shape=2 * (len(points),)))
    count, piece_of = connected_components(graph, directed=False)
    chains = []
    for piece in range(count):
        own = np.flatnonzero(piece_of == piece)
        part = csr_array(graph[own][:, own])
        start = int(np.argmax(_ways(part, 0)))  # the far end, or any place of a closed edge
        ways = _ways(part, start)
        line = points[own[np.argsort(ways, kind="stable")]]
        chains.append(_ended(line, corners, reach))
    return chains


def _ways(graph: csr_array, start: int) -> Array:
    return np.asarray(dijkstra(graph, directed=False, indices=np.array([start]))[0])


def _ended(line: Array, corners: Array, reach: float) -> tuple[Array, bool]:
    """A line with the corners at its ends, and whether it is closed instead."""
    if not len(corners):
        return _around(line), True
    gaps, ends = map(np.asarray, cKDTree(corners).query(line[[0, -1]]))
    if (gaps > 2.0 * _NEXT * reach).any():
        return _around(line), True
    return np.concatenate([corners[ends[:1]], line, corners[ends[1:]]]), False


def _around(line: Array) -> Array:
    """A closed curve in the order of the angle about its middle, in its own plane."""
    x = line - line.mean(axis=0)
    _, _, axes = np.linalg.svd(x, full_matrices=False)
    angles = np.arctan2(x @ axes[1], x @ axes[0])
    ordered = line[np.argsort(angles, kind="stable")]
    return np.concatenate([ordered, ordered[:1]])
