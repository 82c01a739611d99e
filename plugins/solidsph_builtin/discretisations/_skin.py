"""Particles spread evenly over the boundary of a body in space."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array
from solidsph_builtin.discretisations._curves import evenly
from solidsph_builtin.discretisations._edges import lines, onto_edges
from solidsph_builtin.discretisations._features import gap, meetings, smooth
from solidsph_builtin.discretisations._feet import on_boundary
from solidsph_builtin.discretisations._grid import Grid
from solidsph_builtin.discretisations._nearest import beside, thinned
from solidsph_builtin.discretisations._relaxation import relaxed

# Spacing over the gaps between samples by which edges are found.
_FINER = 2.0
# Closer than this, in spacings, two particles of edges are one,
_CLOSEST_ON_EDGES = 0.6
# Places this close, in cells, are the same.
_AT = 1e-6
# Beside what is off the lattice particles move along the surface up to this far away, in spacings.
_MOVES = 4.0
# A step along an edge is known up to this, in cells.
_NEARLY_AT = 1e-3
# Points this close to the boundary, in cells, are on it.
_ON_BOUNDARY = 1e-9
# Steps of particles along the surface.
_STEPS = 40
# Before each time that they move: of two particles closer than the first, in spacings, one is left
# out, and a place further from all than the second gets one. On the lattice that they start from,
# points are nearer to each other than after they have moved.
_FIRST, _THEN = (0.7, 0.75), (0.8, 0.82)
# They move at least so often, and then, without new ones, until no two are too close, at most so
# often.
_LEAST, _MOST = 3, 8


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
    fixed = _to_lattice(shape, grid, _on_edges(shape, spacing))
    points = np.concatenate([fixed, _from_lattice(shape, surface, grid, distance, size)])
    for round_ in range(_MOST):
        closest, empty = _THEN if round_ else _FIRST
        apart = _thinned(points, len(fixed), closest * size)
        if round_ >= _LEAST and len(apart) == len(points):
            break
        points = _filled(apart, surface, empty * size) if round_ < _LEAST else apart
        # What is side by side in space is so in memory, too.
        free = points[len(fixed) :]
        points = np.concatenate([fixed, free[np.argsort(grid.cell_of(free), kind="stable")]])
        at_lattice = grid.has(points)
        off = points[~at_lattice]
        if not len(off):
            return points
        moves = beside(off, points, _MOVES * size)
        moves[: len(fixed)] = False
        points = relaxed(
            points,
            moves,
            lambda x: np.full(len(x), size),
            _STEPS,
            lambda moved: on_boundary(shape, surface, moved, size),
        )
    return points


def _on_edges(shape: Shape, spacing: float) -> Array:
    """Corners, and points in even steps along the edges between them, (m, 3) [m]."""
    surface = shape.surface(spacing)
    if not len(meetings(smooth(surface), gap(surface)).points):
        return surface.points[:0]
    surface = shape.surface(spacing / _FINER)
    reach = gap(surface)
    edges = meetings(smooth(surface), reach)
    corners = meetings(edges, reach).points
    rows = [surface.points[:0]]
    for line in lines(edges, corners, reach):
        rows.append(evenly(line.points, spacing, closed=line.closed))
    points = np.concatenate([corners, onto_edges(shape, edges, np.concatenate(rows), spacing)])
    # Corners come first, so that they stay.
    points = points[thinned(points / spacing, np.arange(len(points)), _CLOSEST_ON_EDGES)]
    return on_boundary(shape, surface, points, spacing)


def _to_lattice(shape: Shape, grid: Grid, points: Array) -> Array:
    """Points (m, 3) on the boundary, those all but at a point of the lattice that is on it moved
    there."""
    there = grid.positions(grid.cell_of(points))
    size = float(grid.steps.min())
    at = np.abs((points - there) / grid.steps).max(axis=1, initial=0.0) <= _NEARLY_AT
    at[at] = np.abs(shape.signed_distance(there[at])) <= _ON_BOUNDARY * size
    return np.where(at[:, None], there, points)


def _from_lattice(
    shape: Shape, surface: Surface, grid: Grid, distance: Array, size: float
) -> Array:
    """Places on the boundary nearest to points of the lattice, each in the cell of its point,
    (m, 3) [m]; those that are nearest come first."""
    near = grid.positions(np.flatnonzero(np.abs(distance) <= grid.half_diagonal))
    feet, _ = grid.snapped(on_boundary(shape, surface, near, size))
    ways = (feet - near) / grid.steps
    order = np.argsort(np.round(np.linalg.norm(ways, axis=1), 6), kind="stable")
    own = np.abs(ways).max(axis=1, initial=0.0) <= 0.5 + _AT
    found: Array = feet[order[own[order]]]
    return found


def _thinned(points: Array, fixed: int, closest: float) -> Array:
    """Points without those closer than that [m] to one before them; the first `fixed` ones stay."""
    stays = thinned(points, np.arange(len(points)), closest)
    stays[:fixed] = True
    return points[stays]


def _filled(points: Array, surface: Surface, empty: float) -> Array:
    """Points and the samples of the surface that are further than that [m] from all of them."""
    gaps = np.asarray(cKDTree(points).query(surface.points)[0])
    some = np.flatnonzero(gaps > empty)
    order = np.argsort(-np.round(gaps[some] / empty, 6), kind="stable")
    more = surface.points[some]
    return np.concatenate([points, more[thinned(more, order, empty)]])
