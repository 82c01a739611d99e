"""Functions of particles that reproduce polynomials, and their integrals over volumes and surfaces.

The functions N_p are those of a moving least squares fit (Lancaster & Salkauskas 1981): the fit to
values f_p has the value sum over p of N_p(x) f_p at x, and it is exact for polynomials of the
second degree as far as the particles near x determine one safely.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property
from itertools import product
from math import ceil
from typing import TYPE_CHECKING

import attrs
import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.discretisations._grid import Grid
from solidsph_builtin.discretisations._surroundings import Surroundings

if TYPE_CHECKING:
    from solidsph_builtin.discretisations._fit_loops import Cells


@attrs.frozen
class Rule:
    """How a fit is made."""

    radius: float  # [spacings]
    degree: int  # of the polynomials at most; PRODUCTS for products of squares along the axes
    determined: float  # of a polynomial at least this part must be left beside those before it
    largest_sum: float  # of |N_p|: beyond it a fit of lower degree takes the place


PRODUCTS = 3

# In a lattice the integrals are those of Gregory's rule, 3/8, 7/6, 23/24, 1 from the surface
# inwards, which integrates cubics exactly, and nearly its products at edges and corners. Without
# products of squares, the corner of a box in space would have 0.006 of a cell, in place of 0.042.
IN_LATTICE = Rule(radius=2.0, degree=PRODUCTS, determined=1e-8, largest_sum=3.0)

# In bodies with scattered particles there are wider fits, for even volumes: with 15 particles
# across, the radial stress in Lame's ring is off by 3.6 % with a radius of 1.8, by 1.6 % with 2.5.
# In space, where surface particles are less even, volumes alternate with less than 2.4 or where a
# fit may extrapolate: a ball under its own weight and with 8 particles along its radius is off by
# 7 % with a radius of 1.8 or 2.1. A hollow ball has radial stresses off by 11 % with a sum of 3,
# since volumes at its corners are thrice or a hundredth of what they should be, by 5 % with 1.6.
# A sum of 1.4 leaves fits of the first degree.
SCATTERED = {
    1: Rule(radius=1.8, degree=2, determined=1e-4, largest_sum=1.6),
    2: Rule(radius=2.5, degree=2, determined=1e-4, largest_sum=1.6),
    3: Rule(radius=2.4, degree=2, determined=1e-4, largest_sum=1.6),
}

# Particles within the radius, at most: a lattice has 4, some 20 and 60, scattered ones more.
_MOST = {1: 6, 2: 40, 3: 160}

# Part of what is nearest to a particle that it gets at least: 0.56 at the corner of a lattice. With
# nothing asked for, a corner of an eighth of a ball had a negative area, and sank in by 4 % of what
# the ball shrinks, in place of 2.
_LEAST_PART = 0.25

# The same of volumes. In space it is 0.34 at the corner of a lattice, by Gregory's rule. Without it
# the middle of an eighth of a ball has 0.005 of a cell, in place of 0.030, and its own vibration is
# the fastest of the body.
_LEAST_VOLUME = 0.3

# What a lone corner passes on to its neighbours adds up to 7 times as much, with both signs.
_FAR = 30.0

# Polynomials whose mean square over the particles is below this are rounding: particles on a plane
# are off it by that, and one that is further off than the others would get no value.
_FLAT = 1e-12

# From so many points on, compiled loops are worth the time of loading the compiler. They know one
# spacing.
_MANY = 20_000

# So few that what is computed for them stays in the cache.
_POINTS_AT_ONCE = 300


@attrs.frozen(eq=False, slots=False)
class Fit:
    """The functions N_p of particles."""

    particles: Array  # positions (n, d) [m]
    spacing: float | Callable[[Array], Array]  # of the particles, one or at X (m, d), (m,) [m]
    grid: Grid | None  # a lattice that many of the particles belong to, if there is one

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.particles)

    def integrals(self, points: Array, weights: Array) -> Array:
        """Integrals of the functions by a quadrature, (n, k), from its points (m, d) [m] and their
        weights (m, k); those of the last are positive.

        Where a particle would get less than a part of what is nearest to it, the points around it
        get fits of lower degree.
        """
        return self._above(points, weights, _LEAST_PART * self._nearest(points, weights[:, -1]))

    def positive_integrals(self, points: Array, weights: Array, wanted: Mask) -> Array:
        """The same with one weight for each point, (m,), and positive where `wanted`, (n,).

        Others, whose functions the points may cover in part only, get any value. Where a fit of the
        second degree would give a particle no positive integral, the points around it get fits of
        lower degree. A particle that still has much less than what is nearest to it gets the rest
        from its neighbours.
        """
        found = self._above(points, weights[:, None], np.where(wanted, 0.0, -np.inf))[:, 0]
        least = np.where(wanted, _LEAST_VOLUME * self._nearest(points, weights), -np.inf)
        return self._with_least(found, least)

    def _nearest(self, points: Array, weights: Array) -> Array:
        """Sum of the weights (m,) of the points (m, d) nearest to each particle, (n,)."""
        if len(points) < _MANY or callable(self.spacing):
            owners = np.asarray(self._tree.query(points)[1])
        else:
            from solidsph_builtin.discretisations._fit_loops import Cells, nearest

            owners = nearest(Cells.of(self.particles, self.spacing), points)
            alone = owners < 0
            owners[alone] = self._tree.query(points[alone])[1]
        sums = np.bincount(owners, weights, minlength=len(self.particles))
        return np.asarray(sums, dtype=np.float64)

    def _with_least(self, integrals: Array, least: Array) -> Array:
        """`integrals` (n,), where possible not below the `least` (n,), with the same sums of all
        polynomials.

        A polynomial's value at a particle is a sum over its neighbours: what the particle gains is
        taken from them in these parts.
        """
        poor, rich = np.flatnonzero(integrals < least), np.flatnonzero(integrals >= least)
        if not (poor.size and rich.size):
            return integrals
        rule = attrs.evolve(self._rule, largest_sum=_FAR)
        tree, degree = cKDTree(self.particles[rich]), np.full(poor.size, rule.degree)
        at = self.particles[poor]
        parts, near = _functions(tree, rule, self._spacing_at(at), at, degree)
        gain = (least - integrals)[poor]
        taken = gain[:, None] * parts
        # Where that is more than a neighbour has, as in a body of few particles, none is gained.
        while gain.any():
            result = integrals.copy()
            result[poor] += gain
            np.subtract.at(result, rich[near], taken)
            robbed = result[rich] < np.minimum(least, integrals)[rich]
            if not robbed.any():
                return result
            refused = (robbed[near] & (taken > 0.0)).any(axis=1)
            gain[refused], taken[refused] = 0.0, 0.0
        return integrals

    def _above(self, points: Array, weights: Array, least: Array) -> Array:
        """Integrals of the weights (m, k), (n, k), by fits of a degree at each point with which
        those of the last are more than the `least` (n,), if some degree gives more."""
        degree = np.full(len(points), self._rule.degree)
        result = self._integrals(points, weights, degree)
        for lower in (1, 0):
            poor = np.flatnonzero(result[:, -1] <= least)
            if not poor.size:
                break
            around = self._depending_on(points, poor)
            some = points[around], weights[around]
            result -= self._integrals(*some, degree[around])
            degree[around] = lower
            result += self._integrals(*some, degree[around])
        return result

    @cached_property
    def _rule(self) -> Rule:
        # One for the whole body: where two meet, the sums of `consistent` would be wrong.
        in_lattice = self.grid is not None and self.grid.has(self.particles).all()
        return IN_LATTICE if in_lattice else SCATTERED[self._tree.m]

    def _spacing_at(self, points: Array) -> Array | float:
        return self.spacing(points) if callable(self.spacing) else self.spacing

    def _depending_on(self, points: Array, particles: Indices) -> Indices:
        """The `points` (m, d) near which some of the particles are, (k,)."""
        if not callable(self.spacing):
            close = cKDTree(points).query_ball_point(self.particles[particles], self.reach)
            return np.unique(np.concatenate(close)).astype(np.intp)
        away = cKDTree(self.particles[particles]).query(points)[0]
        return np.flatnonzero(away < self._rule.radius * self.spacing(points))

    @property
    def reach(self) -> float:
        """Distance up to which particles count, if there is one spacing [m]."""
        assert not callable(self.spacing)
        return self._rule.radius * self.spacing

    @cached_property
    def _lattice(self) -> Surroundings:
        assert self.grid is not None
        return Surroundings.of(self.particles, self.grid, ceil(self._rule.radius))

    def _integrals(self, points: Array, weights: Array, degree: Indices) -> Array:
        result = np.zeros((len(self.particles), weights.shape[1]))
        by_loops = self._rule is not IN_LATTICE and not callable(self.spacing)
        if by_loops and len(points) >= _MANY:
            left = self._add_by_loops(result, points, weights, degree)
            points, weights, degree = points[left], weights[left], degree[left]
        regular = degree == self._rule.degree
        regular &= self.grid is not None and self._lattice.regular(points, self.reach)
        elsewhere = np.flatnonzero(~regular)
        for start in range(0, elsewhere.size, _POINTS_AT_ONCE):
            some = elsewhere[start : start + _POINTS_AT_ONCE]
            values, near = self._functions(points[some], degree[some])
            result += self._sums(values, near, weights[some])
        some = np.flatnonzero(regular)
        if some.size:
            self._add_regular(result, points[some], weights[some])
        return result

    def _add_by_loops(
        self, result: Array, points: Array, weights: Array, degree: Indices
    ) -> Indices:
        """Add to `result` (n, k) the integrals over points (m, d); those that are left out."""
        from solidsph_builtin.discretisations._fit_loops import Fits, add_integrals

        rule, degrees = self._rule, [_degree(power) for power in _powers(self._tree.m).tolist()]
        fits = Fits(
            radius=self.reach,
            powers=_powers(self._tree.m),
            sizes=np.cumsum(np.bincount(degrees)),
            determined=rule.determined,
            flat=_FLAT,
            largest_sum=rule.largest_sum,
            most=min(_MOST[self._tree.m], self._tree.n),
        )
        return add_integrals(self._cells, fits, points, weights, degree, result)

    @cached_property
    def _cells(self) -> Cells:
        from solidsph_builtin.discretisations._fit_loops import cells_for_fits  # loads the compiler

        return cells_for_fits(self.particles, self.reach)

    def _add_regular(self, result: Array, points: Array, weights: Array) -> None:
        """Add to `result` (n, k) the integrals over points (m, d) in a part that is a lattice."""
        lattice = self._lattice
        first, kind = lattice.kinds(points)
        found = [
            self._functions(points[some], np.full(len(some), self._rule.degree))
            for some in np.array_split(first, 1 + len(first) // _POINTS_AT_ONCE)
        ]
        width = max(near.shape[1] for _, near in found)
        values, near = (
            np.concatenate([np.pad(part, ((0, 0), (0, width - part.shape[1]))) for part in parts])
            for parts in zip(*found, strict=True)
        )
        # Where the particles are, from the cell of the point; one without a value may be anywhere.
        count = near.shape[1]
        places = lattice.places(self.particles[near.ravel()]).reshape(near.shape)
        steps = places - lattice.home(points[first])[:, None]
        steps = np.where(values != 0.0, steps, steps[:, :1])
        for start in range(0, len(points), _POINTS_AT_ONCE * count):
            some = slice(start, start + _POINTS_AT_ONCE * count)
            there = lattice.numbers[lattice.home(points[some])[:, None] + steps[kind[some]]]
            there = np.maximum(there, 0)  # where there is no particle, the value is zero
            result += self._sums(values[kind[some]], there, weights[some])

    def _sums(self, values: Array, near: Indices, weights: Array) -> Array:
        starts = near.shape[1] * np.arange(len(near) + 1)
        functions = csr_array(
            (values.ravel(), near.ravel(), starts), shape=(len(near), len(self.particles))
        )
        sums: Array = functions.T @ weights
        return sums

    def _functions(self, points: Array, degree: Indices) -> tuple[Array, Indices]:
        return _functions(self._tree, self._rule, self._spacing_at(points), points, degree)


def _functions(
    tree: cKDTree, rule: Rule, spacing: Array | float, points: Array, degree: Indices
) -> tuple[Array, Indices]:
    """N_p at `points` (m, d) by fits up to some `degree` (m,), both (m, k): the values and the
    particles p."""
    count, radius = min(_MOST[tree.m], tree.n), rule.radius * spacing
    bound = float(np.max(radius))
    found, near = tree.query(points, k=np.arange(1, count + 1), distance_upper_bound=bound)
    distances, near = np.asarray(found), np.asarray(near)
    if isinstance(radius, np.ndarray):
        radius = radius[:, None]
        distances = np.where(distances < radius, distances, np.inf)
    # The nearest particle counts however far it is.
    alone = ~np.isfinite(distances[:, 0])
    if alone.any():
        distances[alone, :1], near[alone, :1] = tree.query(points[alone], k=[1])
    near = np.minimum(near, tree.n - 1)  # those further away weigh nothing, and stand last
    most = int(np.isfinite(distances).sum(axis=1).max(initial=1))
    distances, near = distances[:, :most], near[:, :most]
    reach = np.maximum(radius, 1.01 * distances[:, :1])
    q = np.minimum(distances / reach, 1.0)
    weight = (1.0 - q) ** 4 * (1.0 + 4.0 * q)
    offsets = (tree.data[near] - points[:, None, :]) / reach[:, :, None]
    values: Array = weight * _fits(weight, offsets, degree, rule)
    return values, near


def _fits(weight: Array, offsets: Array, degree: Indices, rule: Rule) -> Array:
    """The functions over their weight, (m, k), from the weights (m, k) of near particles and their
    `offsets` (m, k, d) from the points, in radii."""
    powers = _powers(offsets.shape[2])
    degrees = np.array([_degree(power) for power in powers])
    powers = powers[degrees <= degree.max(initial=0)]
    known = {tuple(power): number for number, power in enumerate(powers.tolist())}
    basis = np.ones((len(offsets), len(powers), offsets.shape[1]))
    for number, power in enumerate(powers[1:].tolist(), start=1):
        axis = int(np.flatnonzero(power)[-1])
        power[axis] -= 1
        np.multiply(basis[:, known[tuple(power)]], offsets[:, :, axis], out=basis[:, number])
    moments = (basis * weight[:, None, :]) @ basis.transpose(0, 2, 1)
    accepted = np.zeros(weight.shape)
    waiting = np.ones(len(degree), dtype=np.bool_)
    for number in range(int(degree.max(initial=0)), -1, -1):
        some = np.flatnonzero(waiting & (degree >= number))
        own = slice(None) if len(some) == len(degree) else some  # without copies
        size = int(np.sum(degrees <= number))
        factors = _first_column(moments[own, :size, :size], rule.determined)
        fitted = np.einsum("mjk,mj->mk", basis[own, :size], factors)
        safe = np.abs(weight[own] * fitted).sum(axis=1) <= rule.largest_sum
        accepted[some[safe]] = fitted[safe]
        waiting[some[safe]] = False
    return accepted


@cache
def _powers(dimension: int) -> Indices:
    """Exponents of the monomials, of the lowest degree first, (number, d)."""
    powers = sorted(product(range(3), repeat=dimension), key=lambda power: (_degree(power), power))
    return np.array(powers)


def _degree(power: Sequence[int]) -> int:
    """0, 1 or 2, or 3 for all products of at most squares along the axes."""
    return min(int(sum(power)), PRODUCTS)


def _first_column(moments: Array, determined: float) -> Array:
    """First column of the inverse of symmetric matrices (m, j, j), without the rows and columns
    that the earlier ones determine, (m, j)."""
    m, size = moments.shape[:2]
    lower = np.zeros((size, size, m))
    pivots, known = np.zeros((size, m)), np.zeros((size, m), dtype=np.bool_)
    M = np.ascontiguousarray(moments.transpose(1, 2, 0))
    for j in range(size):
        pivot = M[j, j] - np.einsum("km,km->m", lower[j, :j] ** 2, pivots[:j])
        known[j] = (pivot > determined * M[j, j]) & (M[j, j] > _FLAT * M[0, 0])
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
