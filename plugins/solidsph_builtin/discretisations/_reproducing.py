"""Functions of particles that reproduce polynomials, and their integrals over volumes and surfaces.

The functions N_p are those of a moving least squares fit (Lancaster & Salkauskas 1981): the fit to
values f_p has the value sum over p of N_p(x) f_p at x, and it is exact for polynomials of the
second degree as far as the particles near x determine one safely.
"""

from __future__ import annotations

from functools import cached_property
from itertools import combinations_with_replacement

import attrs
import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices

# Radius of the fit, in spacings. On a lattice its integrals are then those of Gregory's rule of the
# second order, 5/12, 13/12, 1 from the surface inwards, which integrates cubics exactly. With 2.2 they
# are 3/8, 7/6, 23/24, 1, but in the corner of a box 0.003 of a cell, here 0.059.
RADIUS = 1.8

# Particles within the radius, at most: a lattice has 4, 14 and 33, scattered ones more.
_MOST = {1: 6, 2: 24, 3: 64}

# A polynomial of which less than this part is left, once those of lower degree are subtracted, is
# not determined by the particles.
_DETERMINED = 1e-4

# Sum of |N_p| beyond which a fit extrapolates too far, and one of lower degree takes its place. It
# is 1.8 at most in lattices with particles on the boundary.
_LARGEST_SUM = 3.0

_POINTS_AT_ONCE = 20_000


@attrs.frozen(eq=False, slots=False)
class Fit:
    """The functions N_p of particles."""

    particles: Array  # positions (n, d) [m]
    spacing: float  # of the particles [m]

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

    def _integrals(self, points: Array, weights: Array, degree: Indices) -> Array:
        result = np.zeros((len(self.particles), weights.shape[1]))
        for start in range(0, len(points), _POINTS_AT_ONCE):
            some = slice(start, start + _POINTS_AT_ONCE)
            functions = _functions(self._tree, RADIUS * self.spacing, points[some], degree[some])
            result += functions.T @ weights[some]
        return result


def _functions(tree: cKDTree, radius: float, points: Array, degree: Indices) -> csr_array:
    """N_p at `points` (m, d) by fits up to some `degree` (m,), (m, n)."""
    m, d = points.shape
    count = min(_MOST[d], tree.n)
    found, near = tree.query(points, k=np.arange(1, count + 1))
    distances, near = np.asarray(found), np.asarray(near)
    # The nearest particle counts however far it is.
    reach = np.maximum(radius, 1.01 * distances[:, :1])
    weight = np.maximum(1.0 - distances / reach, 0.0) ** 4 * (1.0 + 4.0 * distances / reach)
    offsets = (tree.data[near] - points[:, None, :]) / reach[:, :, None]
    x = list(np.moveaxis(offsets, 2, 0))
    degrees = [np.ones_like(weight)], x, [a * b for a, b in combinations_with_replacement(x, 2)]
    # At the particles (m, count), and at the point itself (m,).
    orthonormal: list[tuple[Array, Array]] = []
    fitted = accepted = np.zeros((m, count))
    for number, monomials in enumerate(degrees):
        for f in monomials:
            here = np.full(m, float(number == 0))
            size = np.einsum("mk,mk,mk->m", weight, f, f)
            for _ in range(2):  # again, for rounding
                for g, g_here in orthonormal:
                    part = np.einsum("mk,mk,mk->m", weight, f, g)
                    f, here = f - part[:, None] * g, here - part * g_here
            left = np.einsum("mk,mk,mk->m", weight, f, f)
            known = left > _DETERMINED * size
            scale = np.where(known, 1.0 / np.sqrt(np.where(known, left, 1.0)), 0.0)
            orthonormal.append((f * scale[:, None], here * scale))
            fitted = fitted + (weight * scale[:, None] * f) * (here * scale)[:, None]
        safe = (np.abs(fitted).sum(axis=1) <= _LARGEST_SUM) & (number <= degree)
        accepted = np.where(safe[:, None], fitted, accepted)
    starts = count * np.arange(m + 1)
    return csr_array((accepted.ravel(), near.ravel(), starts), shape=(m, tree.n))
