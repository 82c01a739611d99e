"""Particles spread evenly over the boundary of a body in space."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.discretisations._curves import evenly
from solidsph_builtin.discretisations._edges import lines
from solidsph_builtin.discretisations._features import gap, meetings, smooth
from solidsph_builtin.discretisations._feet import on_boundary
from solidsph_builtin.discretisations._grid import Grid
from solidsph_builtin.discretisations._nearest import thinned
from solidsph_builtin.discretisations._relaxation import relaxed
from solidsph_builtin.discretisations.conforming_lattice import outermost

# Spacing over the gaps between samples by which edges are found.
_FINER = 2.0
# Closer than this, in spacings, two particles of edges are one,
_CLOSEST_ON_EDGES = 0.6
# and of two others one is left out.
_CLOSEST = 0.7
# A place further than this from all particles, in spacings, gets one.
_EMPTY = 0.75
# Beside what is off the lattice particles move along the surface up to this far away, in spacings.
_MOVES = 4.0
# Steps of particles along the surface, and how often some are left out and put in.
_STEPS, _ROUNDS = 40, 3


def even_skin(shape: Shape, grid: Grid, distance: Array, spacing: float, size: float) -> Array:
    """Particles on the boundary, (m, 3) [m].

    Each corner has one, and each edge has them in even steps between its corners. Elsewhere the
    points of the `grid` beside the boundary start from there, and repel each other along it; where
    they are crowded some go, and where a gap is left some come.

    Args:
        shape: the body.
        grid: a lattice over it, with points on the faces of its box.
        distance: of all points of the lattice, (size,) [m].
        spacing: of the particles [m].
        size: the spacing in the lattice [m].
    """
    surface = shape.surface(spacing)
    fixed, _ = grid.snapped(_on_edges(shape, spacing))
    start, on_smooth = outermost(shape, grid, distance, size)
    start, at_lattice = grid.snapped(start)
    start, at_lattice = start[on_smooth], at_lattice[on_smooth]
    start = start[np.argsort(~at_lattice, kind="stable")]
    points = np.concatenate([fixed, start])
    for round_ in range(_ROUNDS):
        points = _thinned(points, len(fixed), size)
        points = _filled(points, surface, size)
        at_lattice = grid.has(points)
        free = np.arange(len(points)) >= len(fixed)
        off = points[~at_lattice]
        if not len(off):
            return points
        free &= cKDTree(off).query(points)[0] < _MOVES * size
        points = relaxed(
            points,
            free,
            lambda x: np.full(len(x), size),
            _STEPS,
            lambda moved: on_boundary(shape, surface, moved, size),
        )
    return points


def _on_edges(shape: Shape, spacing: float) -> Array:
    """Corners, and points in even steps along the edges between them, (m, 3) [m]."""
    surface = shape.surface(spacing / _FINER)
    reach = gap(surface)
    edges = meetings(smooth(surface), reach)
    corners = meetings(edges, reach).points
    rows = [corners]
    for line in lines(edges, corners, reach):
        rows.append(evenly(line.points, spacing, closed=line.closed))
    points = np.concatenate(rows)
    # Corners come first, so that they stay.
    points = points[thinned(points / spacing, np.arange(len(points)), _CLOSEST_ON_EDGES)]
    return on_boundary(shape, surface, points, spacing)


def _thinned(points: Array, fixed: int, size: float) -> Array:
    """Points without those too close to one before them; the first `fixed` ones stay."""
    stays = thinned(points / size, np.arange(len(points)), _CLOSEST)
    stays[:fixed] = True
    return points[stays]


def _filled(points: Array, surface: Surface, size: float) -> Array:
    """Points and the samples of the surface that are far from all of them."""
    gaps = cKDTree(points).query(surface.points)[0] / size
    empty = np.flatnonzero(gaps > _EMPTY)
    order = np.argsort(-np.round(gaps[empty], 6), kind="stable")
    more = surface.points[empty]
    return np.concatenate([points, more[thinned(more / size, order, _EMPTY)]])
