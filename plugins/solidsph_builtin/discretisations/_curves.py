"""Particles in even steps along the boundary of a plane shape."""

from __future__ import annotations

from math import floor

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape, Surface
from solidsph.maths.arrays import Array, Indices
from solidsph.model.spacing import SpacingField
from solidsph_builtin.discretisations._features import meetings, smooth
from solidsph_builtin.discretisations._feet import on_boundary
from solidsph_builtin.discretisations._nearest import thinned
from solidsph_builtin.shapes._sampling import cells_along

# Spacing over the size of the pieces into which the boundary is divided to find it.
_FINER = 4.0

# Samples follow each other along a curve if they are no further apart than this, in their lengths,
# and turn by less than 30 degrees.
_NEXT = 1.5
_SMOOTH = np.cos(np.radians(30.0))

# An end of a curve is at the corner that is nearest to it, at most so many samples away.
_TO_CORNER = 4.0

# Particles around a quarter of a closed curve are rounded up from 0.9 only.
_UP = 0.1

# Steps around a closed curve, in spacings, that are even enough.
_EVEN = 0.8, 1.2

# Two particles closer than this, in spacings, are one.
_CLOSEST = 0.4


def even_points(shape: Shape, spacing: float) -> Array:
    """Points on the boundary of a plane `shape`, (m, 2) [m].

    Each corner has a point. Between two corners the points are evenly spaced, as nearly `spacing`
    [m] apart as their number allows.
    """
    surface = shape.surface(spacing / _FINER)
    lengths = np.linalg.norm(surface.area_vectors, axis=1)
    corners = meetings(smooth(surface), float(lengths.max())).points
    rows = [corners]
    for curve in _curves(surface, lengths):
        line = _with_ends(surface, lengths, curve, corners)
        rows.append(evenly(line, spacing, closed=_is_closed(line, lengths[curve])))
    points = np.concatenate(rows)
    # Corners come first, so that they stay.
    points = points[thinned(points / spacing, np.arange(len(points)), _CLOSEST)]
    return on_boundary(shape, surface, points, spacing)


def graded_points(shape: Shape, spacing: SpacingField) -> Array:
    """Points on the boundary of a plane `shape`, as far apart as a spacing that varies says, (m, 2)
    [m]; each corner has one."""
    surface = shape.surface(spacing.least / _FINER)
    lengths = np.linalg.norm(surface.area_vectors, axis=1)
    corners = meetings(smooth(surface), float(lengths.max())).points
    rows = [corners]
    for curve in _curves(surface, lengths):
        line = _with_ends(surface, lengths, curve, corners)
        rows.append(graded_steps(line, spacing, closed=_is_closed(line, lengths[curve])))
    points = np.concatenate(rows)
    points = points[thinned(points, np.arange(len(points)), _CLOSEST * spacing.least)]
    return on_boundary(shape, surface, points, spacing.least)


def graded_steps(line: Array, spacing: SpacingField, *, closed: bool) -> Array:
    """Points along a polygonal `line` (m, d) in steps that follow a spacing that varies, its ends
    included, (k, d) [m]."""
    lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
    steps = lengths / spacing.at(0.5 * (line[1:] + line[:-1]))
    way = np.concatenate([[0.0], np.cumsum(steps)])
    count = cells_along(float(way[-1]), 1.0)
    if closed:
        count = 4 * max(1, floor(float(way[-1]) / 4.0 + _UP))
    places = np.linspace(0.0, way[-1], count + 1)[: count + (not closed)]
    return np.stack([np.interp(places, way, x) for x in line.T], axis=1)


def _curves(surface: Surface, lengths: Array) -> list[Indices]:
    """Samples of each smooth curve in their order: runs of samples that follow each other."""
    points = surface.points
    normals = surface.area_vectors / lengths[:, None]
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
    broken = apart > _NEXT * np.maximum(lengths[1:], lengths[:-1])
    broken |= np.einsum("mi,mi->m", normals[1:], normals[:-1]) < _SMOOTH
    return np.split(np.arange(len(points)), np.flatnonzero(broken) + 1)


def _with_ends(surface: Surface, lengths: Array, curve: Indices, corners: Array) -> Array:
    """The points of a curve and its two ends, (m + 2, 2) [m]."""
    points = surface.points[curve]
    normals = surface.area_vectors[curve[[0, -1]]]
    along = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    along *= 0.5
    # Forwards if the samples run that way; a single one may run either way.
    if len(points) > 1 and along[0] @ (points[1] - points[0]) < 0.0:
        along = -along
    ends = np.stack([points[0] - along[0], points[-1] + along[1]])
    if len(corners):
        gaps, nearest = cKDTree(corners).query(points[[0, -1]])
        at = gaps <= _TO_CORNER * lengths[curve[[0, -1]]]
        ends[at] = corners[np.asarray(nearest)[at]]
    return np.concatenate([ends[:1], points, ends[1:]])


def _is_closed(line: Array, lengths: Array) -> bool:
    return bool(np.linalg.norm(line[-1] - line[0]) < 0.5 * float(lengths.min()))


def evenly(line: Array, spacing: float, *, closed: bool) -> Array:
    """Points in equal steps along a polygonal `line` (m, d), its ends included, (k, d) [m]."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    length = float(way[-1])
    steps = cells_along(length, spacing)
    # As many in each quarter, so that a hole is as symmetric as its body; rather too few than too
    # many, which crowd those inside. A small hole has as many as fit.
    quarter = max(1, floor(length / (4.0 * spacing) + _UP))
    if closed:
        steps = 4 * quarter if _EVEN[0] < length / (4.0 * spacing * quarter) < _EVEN[1] else steps
    places = np.linspace(0.0, way[-1], steps + 1)[: steps + (not closed)]
    return np.stack([np.interp(places, way, along) for along in line.T], axis=1)
