"""Particles on the surface and inside a shape, as far apart as a spacing that varies says.

Inside, cells finer than the spacing are passed in an order that keeps neighbours together (Morton
1966), and their shares of a particle add up: at each whole number there is one. So the number of
particles is right everywhere; repulsion then makes their distances even.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Indices
from solidsph.model.pair_search import PairSearch
from solidsph.model.particles import Particles
from solidsph.model.spacing import SpacingField, cells_over
from solidsph.system.build_log import BUILD
from solidsph_builtin.discretisations._checks import check_count, refusal
from solidsph_builtin.discretisations._curves import graded_points
from solidsph_builtin.discretisations._graded_fitting import graded_fit
from solidsph_builtin.discretisations._graded_relaxation import relaxed_by
from solidsph_builtin.discretisations._graded_samples import graded_samples
from solidsph_builtin.discretisations._graded_surface import surface_points
from solidsph_builtin.discretisations._nearest import nearest, thinned_pairs
from solidsph_builtin.discretisations._sampled_once import sampled_once
from solidsph_builtin.discretisations._surface import faces, without_ghosts

# A place this part less deep than a spacing below its own part of the surface belongs to another.
_OTHER = 0.1
# In spacings: two particles of the rows beside the surface closer than this become one, and further
# than the second from them is room for others.
_CLOSEST, _CLEAR = 0.7, 0.58
# Cells along a spacing, at least.
_CELLS = 2.0
# Steps of the relaxation.
_STEPS = 200
# Bits of a place along an axis, for the order.
_BITS = 20


def graded(discretisation: Discretisation, shape: Shape, spacing: SpacingField) -> Particles:
    """Particles of `shape` as far apart as the `spacing` says, with fitted volumes and areas.

    Raises:
        SceneError: there would be too many, or no particle has a place inside the surface.
    """
    shape = sampled_once(shape)
    BUILD.debug("on the surface")
    outer = _outer(discretisation, shape, spacing)
    held = np.concatenate([outer, _row(shape, spacing, outer)])
    inner = _inner(discretisation, shape, spacing, held)
    X = np.concatenate([held, inner])
    if len(X) == len(outer):
        raise refusal(
            discretisation,
            f"the body has no place inside its surface for particles {spacing.least:.4g} to "
            f"{spacing.greatest:.4g} m apart; use smaller spacings",
        )
    place = np.arange(len(X))
    X = relaxed_by(X, place >= len(held), spacing.at, _STEPS)
    onto = place < len(outer)
    kept = (place < len(held)) | (shape.signed_distance(X) < -_CLEAR * spacing.at(X))
    X, onto = X[kept], onto[kept]
    order = _order(X, *shape.bounds())
    X, onto = X[order], onto[order]
    surface = graded_samples(discretisation, shape, spacing)
    at = np.flatnonzero(onto)
    owners = nearest(cKDTree(X[at]), surface.points)
    owners = attrs.evolve(owners, particles=at[owners.particles])
    owned = faces(surface, owners, X)
    given = without_ghosts(X, np.ones(len(X)), spacing.at(X), owned)
    return graded_fit(discretisation, shape, spacing, given)


def _outer(discretisation: Discretisation, shape: Shape, spacing: SpacingField) -> Array:
    """Particles on the boundary, (m, d) [m]."""
    if shape.dimension == 1:
        return np.stack(shape.bounds())
    if shape.dimension == 2:
        return graded_points(shape, spacing)
    return surface_points(discretisation, shape, spacing)


def _row(shape: Shape, spacing: SpacingField, outer: Array) -> Array:
    """A row of particles that follows the surface, a spacing below those on it, (m, d) [m].

    In Lame's ring with spacings from a tenth to a third of the inner radius, the hoop stress there
    is off by 0.95 % (root mean square) without it, 0.51 % with it, 0.67 and 0.56 % with 2 and 4.
    """
    surface = shape.surface(spacing.least)
    areas = surface.area_vectors[cKDTree(surface.points).query(outer)[1]]
    inwards = -areas / np.linalg.norm(areas, axis=1, keepdims=True)
    s = spacing.at(outer)
    depths = 0.5 * (s + spacing.at(outer + s[:, None] * inwards))
    X = outer + depths[:, None] * inwards
    X = X[-shape.signed_distance(X) > (1.0 - _OTHER) * depths]
    every = np.concatenate([outer, X])
    near = PairSearch.of(every, _CLOSEST * spacing.at(every)).near(np.arange(len(every)))
    pairs = np.column_stack(near)
    stays = thinned_pairs(pairs[pairs[:, 0] < pairs[:, 1]], np.arange(len(every)))
    row: Array = X[stays[len(outer) :]]
    return row


def _inner(
    discretisation: Discretisation, shape: Shape, spacing: SpacingField, held: Array
) -> Array:
    """Places that are left inside, before they are relaxed, (m, d) [m]."""
    d = shape.dimension
    lower, upper = shape.bounds()
    cells = cells_over(
        lower, upper, spacing.at, lambda X, reach: shape.signed_distance(X) < reach, 1.0 / _CELLS
    )
    s = spacing.at(cells.centres)
    free = cKDTree(held).query(cells.centres)[0] > _CLEAR * s
    free &= shape.signed_distance(cells.centres) < 0.0
    expected = free * (cells.sizes / s) ** d
    check_count(discretisation, float(expected.sum()))
    order = _order(cells.centres, lower, upper)
    whole = np.floor(0.5 + np.concatenate([[0.0], np.cumsum(expected[order])]))
    chosen = order[np.diff(whole) > 0.0]
    return cells.centres[chosen]


def _order(X: Array, lower: Array, upper: Array) -> Indices:
    """Morton's order of places X (n, d) in a box, (n,)."""
    d = X.shape[1]
    size = float((upper - lower).max())
    places = ((X - lower) / size * (1 << _BITS)).astype(np.int64)
    places = np.clip(places, 0, (1 << _BITS) - 1)
    keys = np.zeros(len(X), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(d):
            keys |= ((places[:, axis] >> bit) & 1) << (bit * d + axis)
    return np.asarray(np.argsort(keys, kind="stable"), dtype=np.intp)
