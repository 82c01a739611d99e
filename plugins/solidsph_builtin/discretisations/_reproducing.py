"""Functions of particles that reproduce polynomials, and their integrals over volumes and surfaces.

The functions N_p are those of a moving least squares fit (Lancaster & Salkauskas 1981): the fit to
values f_p has the value sum over p of N_p(x) f_p at x, and it is exact for polynomials of the
second degree as far as the particles near x determine one safely.
"""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.discretisations._grid import Grid
from solidsph_builtin.discretisations._surroundings import Surroundings

# Radius of the fit, in spacings. On a lattice the integrals are then those of Gregory's rule with
# first differences, 5/12, 13/12, 1 from the surface inwards: beside a surface the fit is linear,
# since it has two rows of particles there. With 2 it is quadratic, and the rule 3/8, 7/6, 23/24, 1;
# but then a corner of a box in space has 0.006 of a cell, in place of 0.058, and a stable step to
# match, and the stress at a curved surface is no better.
RADIUS = 1.8

# Particles within the radius, at most: a lattice has 4, 14 and 33, scattered ones more.
_MOST = {1: 6, 2: 24, 3: 64}

# A polynomial of which less than this part is left, once those of lower degree are subtracted, is
# not determined by the particles.
_DETERMINED = 1e-4

# Sum of |N_p| beyond which a fit extrapolates too far, and one of lower degree takes its place. It
# is 1.8 at most in lattices with particles on the boundary.
_LARGEST_SUM = 3.0

# So few that what is computed for them stays in the cache.
_POINTS_AT_ONCE = 300


@attrs.frozen(eq=False, slots=False)
class Fit:
    """The functions N_p of particles."""

    particles: Array  # positions (n, d) [m]
    spacing: float  # of the particles [m]
    grid: Grid  # a lattice that many of the particles belong to

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.particles)

    def integrals(self, points: Array, weights: Array) -> Array:
        """Integrals of the functions by a quadrature, (n, k), from its points (m, d) [m] and their
        weights (m, k)."""
        return self._integrals(points, weights, np.full(len(points), 2))

    def positive_integrals(self, points: Array, weights: Array) -> Array:
        """The same with one weight for each point, (m,), and positive, (n,).

        Where a fit of the second degree would give a particle no positive integral, the points
        around it get fits of lower degree.
        """
        degree = np.full(len(points), 2)
        weights = weights[:, None]
        result = self._integrals(points, weights, degree)
        for lower in (1, 0):
            poor = np.flatnonzero(result[:, 0] <= 0.0)
            if not poor.size:
                break
            close = cKDTree(points).query_ball_point(self.particles[poor], RADIUS * self.spacing)
            around = np.unique(np.concatenate(close)).astype(np.intp)
            some = points[around], weights[around]
            result -= self._integrals(*some, degree[around])
            degree[around] = lower
            result += self._integrals(*some, degree[around])
        return result[:, 0]

    @cached_property
    def _lattice(self) -> Surroundings:
        return Surroundings.of(self.particles, self.grid)

    def _integrals(self, points: Array, weights: Array, degree: Indices) -> Array:
        result = np.zeros((len(self.particles), weights.shape[1]))
        regular = self._lattice.regular(points, RADIUS * self.spacing)
        regular &= degree == 2
        elsewhere = np.flatnonzero(~regular)
        for start in range(0, elsewhere.size, _POINTS_AT_ONCE):
            some = elsewhere[start : start + _POINTS_AT_ONCE]
            values, near = self._functions(points[some], degree[some])
            result += self._sums(values, near, weights[some])
        some = np.flatnonzero(regular)
        if some.size:
            self._add_regular(result, points[some], weights[some])
        return result

    def _add_regular(self, result: Array, points: Array, weights: Array) -> None:
        """Add to `result` (n, k) the integrals over points (m, d) in a part that is a lattice."""
        lattice = self._lattice
        first, kind = lattice.kinds(points)
        found = [
            self._functions(points[some], np.full(len(some), 2))
            for some in np.array_split(first, 1 + len(first) // _POINTS_AT_ONCE)
        ]
        values, near = (np.concatenate(parts) for parts in zip(*found, strict=True))
        # Where the particles are, from the cell of the point; one without a value may be anywhere.
        count = near.shape[1]
        places = lattice.places(self.particles[near.ravel()]).reshape(near.shape)
        steps = places - lattice.home(points[first])[:, None]
        steps = np.where(values != 0.0, steps, steps[:, :1])
        for start in range(0, len(points), _POINTS_AT_ONCE * count):
            some = slice(start, start + _POINTS_AT_ONCE * count)
            there = lattice.numbers[lattice.home(points[some])[:, None] + steps[kind[some]]]
            result += self._sums(values[kind[some]], there, weights[some])

    def _sums(self, values: Array, near: Indices, weights: Array) -> Array:
        starts = near.shape[1] * np.arange(len(near) + 1)
        functions = csr_array(
            (values.ravel(), near.ravel(), starts), shape=(len(near), len(self.particles))
        )
        sums: Array = functions.T @ weights
        return sums

    def _functions(self, points: Array, degree: Indices) -> tuple[Array, Indices]:
        return _functions(self._tree, RADIUS * self.spacing, points, degree)


def _functions(
    tree: cKDTree, radius: float, points: Array, degree: Indices
) -> tuple[Array, Indices]:
    """N_p at `points` (m, d) by fits up to some `degree` (m,), both (m, k): the values and the
    particles p."""
    count = min(_MOST[tree.m], tree.n)
    found, near = tree.query(points, k=np.arange(1, count + 1), distance_upper_bound=radius)
    distances, near = np.asarray(found), np.asarray(near)
    # The nearest particle counts however far it is.
    alone = ~np.isfinite(distances[:, 0])
    if alone.any():
        distances[alone, :1], near[alone, :1] = tree.query(points[alone], k=[1])
    reach = np.maximum(radius, 1.01 * distances[:, :1])
    q = np.minimum(distances / reach, 1.0)
    near = np.minimum(near, tree.n - 1)  # those further away weigh nothing
    weight = (1.0 - q) ** 4 * (1.0 + 4.0 * q)
    offsets = (tree.data[near] - points[:, None, :]) / reach[:, :, None]
    return weight * _fits(weight, offsets, degree), near


def _fits(weight: Array, offsets: Array, degree: Indices) -> Array:
    """The functions over their weight, (m, k), from the weights (m, k) of near particles and their
    `offsets` (m, k, d) from the points, in radii."""
    d = offsets.shape[2]
    upper = np.triu_indices(d)
    basis = np.concatenate(
        [np.ones((*weight.shape, 1)), offsets, offsets[..., upper[0]] * offsets[..., upper[1]]],
        axis=2,
    )
    degrees = np.repeat([0, 1, 2], [1, d, len(upper[0])])
    moments = (basis * weight[:, :, None]).transpose(0, 2, 1) @ basis
    accepted = np.zeros(weight.shape)
    for number in (0, 1, 2):
        some = np.flatnonzero(degree >= number)
        size = int(np.sum(degrees <= number))
        factors = _first_column(moments[some, :size, :size])
        fitted = np.einsum("mkj,mj->mk", basis[some, :, :size], factors)
        safe = np.abs(weight[some] * fitted).sum(axis=1) <= _LARGEST_SUM
        accepted[some[safe]] = fitted[safe]
    return accepted


def _first_column(moments: Array) -> Array:
    """First column of the inverse of symmetric matrices (m, j, j), without the rows and columns
    that the earlier ones determine, (m, j)."""
    m, size = moments.shape[:2]
    lower = np.zeros((size, size, m))
    pivots, known = np.zeros((size, m)), np.zeros((size, m), dtype=np.bool_)
    M = np.ascontiguousarray(moments.transpose(1, 2, 0))
    for j in range(size):
        pivot = M[j, j] - np.einsum("km,km->m", lower[j, :j] ** 2, pivots[:j])
        known[j] = pivot > _DETERMINED * M[j, j]
        pivots[j] = np.where(known[j], pivot, 1.0)
        rest = M[j + 1 :, j] - np.einsum(
            "ikm,km->im", lower[j + 1 :, :j], lower[j, :j] * pivots[:j]
        )
        lower[j + 1 :, j] = np.where(known[j], rest / pivots[j], 0.0)
    # Of the unit vector along the first axis: forwards, then backwards.
    x = np.zeros((size, m))
    x[0] = 1.0
    for j in range(1, size):
        x[j] = -np.einsum("km,km->m", lower[j, :j], x[:j])
    x = np.where(known, x / pivots, 0.0)
    for j in range(size - 2, -1, -1):
        x[j] -= np.where(known[j], np.einsum("km,km->m", lower[j + 1 :, j], x[j + 1 :]), 0.0)
    result: Array = x.T
    return result
