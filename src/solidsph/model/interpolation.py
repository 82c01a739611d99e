"""Interpolation of what particles carry, of the second order up to the surface.

A moving least squares fit (Lancaster & Salkauskas 1981, Math. Comp. 37, 141-158) of the second
degree to the values f_p of near particles has the value sum over p of N_p(x) f_p at x. The
functions N_p and their slopes depend on the particles alone. The slopes are those of the fitted
polynomial at x ("diffuse derivatives", Nayroles, Touzot & Villon 1992).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement
from typing import TypeAlias

import attrs
import numpy as np
from scipy.sparse import csr_array, vstack
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import row_starts

Sees: TypeAlias = Callable[[Array, Indices], Mask]
"""Whether points (m, d) see particles (m, k), (m, k)."""

# Radius of a fit around a particle, in spacings. Where it does not determine the second degree, as
# beside a surface with irregular particles, a wider one is tried.
_RADIUS = 2.2
_WIDER = (1.0, 1.3, 1.6)

# Particles within the largest radius, at most: a lattice has 7, 32 and 123.
_MOST = {1: 8, 2: 40, 3: 150}

# A polynomial of which less than this part is left, once those before it are subtracted, is not
# determined by the particles.
_DETERMINED = 1e-6

# Sum of |N_p| beyond which a fit extrapolates too far, and one of lower degree takes its place. At
# the corner of a lattice it is 1.65 with particles on the boundary, and with particles at the
# centres of cells 3.5, 7.0 and 10.7 in 1, 2 and 3D.
_LARGEST_SUM = 12.0

# So that the arrays of a fit stay in cache.
_POINTS_AT_ONCE = 512


@attrs.frozen(eq=False)
class ShapeFunctions:
    """N_p and their slopes at m points; all matrices have their entries in the same places."""

    values: csr_array  # (m, n) N_p(x) [-]
    slopes: Sequence[csr_array]  # d of (m, n), dN_p/dx_k [1/m]; none if not asked for


def shape_functions(
    particles: Array,
    spacing: Array | float,
    points: Array,
    sees: Sees | None = None,
    *,
    slopes: bool = True,
) -> ShapeFunctions:
    """The functions N_p of particles at any points, and their slopes if wanted.

    They reproduce polynomials of the second degree wherever the particles determine them safely,
    and otherwise as many as they do determine; constants always.

    Args:
        particles: positions (n, d) [m].
        spacing: of the particles, one or that of each (n,) [m].
        points: (m, d) [m].
        sees: which particles a point depends on; all near ones if None.
        slopes: whether slopes are wanted.
    """
    count = 1 + particles.shape[1] if slopes else 1
    tree = cKDTree(particles)
    parts = [
        _functions(tree, spacing, points[first : first + _POINTS_AT_ONCE], sees)[:count]
        for first in range(0, max(1, len(points)), _POINTS_AT_ONCE)
    ]
    stacked = [csr_array(vstack(blocks, format="csr")) for blocks in zip(*parts, strict=True)]
    return ShapeFunctions(stacked[0], stacked[1:])


def _functions(
    tree: cKDTree, spacing: Array | float, points: Array, sees: Sees | None
) -> Sequence[csr_array]:
    """N_p and its slopes at a few points, (1 + d) times (m, n)."""
    m, d = points.shape
    count = min(_MOST[d], tree.n)
    found, near = tree.query(points, k=np.arange(1, count + 1))
    distances, near = np.asarray(found), np.asarray(near, dtype=np.intp)
    if sees is not None:
        seen = sees(points, near)
        # A point that sees nobody depends on the nearest.
        seen[:, 0] |= ~seen.any(axis=1)
        distances = np.where(seen, distances, np.inf)
    # Beyond the surface there is nobody, so there the fit reaches further.
    there = spacing[near[:, 0]] if isinstance(spacing, np.ndarray) else spacing
    reach = _RADIUS * there + distances.min(axis=1)
    offsets = tree.data[near] - points[:, None, :]
    fitted = np.zeros((m, 1 + d, count))
    left = np.arange(m)
    for wider in _WIDER:
        radius = wider * reach[left]
        weights = _weights(distances[left] / radius[:, None])
        k = int(np.flatnonzero(weights.any(axis=0))[-1]) + 1  # the others are too far
        fit, complete = _fit(offsets[left, :k] / radius[:, None, None], weights[:, :k])
        fit[:, 1:] /= radius[:, None, None]
        # Of fits that are all incomplete, the narrowest counts.
        taken = complete | (wider == _WIDER[0])
        fitted[left[taken], :, :k] = fit[taken]
        left = left[~complete]
        if not left.size:
            break
    within = np.any(fitted != 0.0, axis=1)
    starts = row_starts(within.sum(axis=1))
    return [
        csr_array((fitted[:, k][within], near[within], starts), shape=(m, tree.n))
        for k in range(1 + d)
    ]


def _weights(q: Array) -> Array:
    """Wendland's function (1 - q)^4 (1 + 4 q)."""
    q = np.minimum(q, 1.0)
    weights: Array = (1.0 - q) ** 4 * (1.0 + 4.0 * q)
    return weights


def _fit(x: Array, weights: Array) -> tuple[Array, Mask]:
    """Weight of each particle in the value of a fit at the origin and in its slopes, (m, 1 + d, k),
    and whether the fit is of the second degree, (m,).

    Monomials are made orthonormal one by one, so that those that the particles do not determine
    are left out.

    Args:
        x: particles from the origin, (m, k, d).
        weights: of the particles, (m, k).
    """
    m, k, d = x.shape
    along = list(np.moveaxis(x, 2, 0))
    products = [a * b for a, b in combinations_with_replacement(along, 2)]
    # At the particles (m, k), and value and slopes at the origin (m, 1 + d).
    orthonormal: list[tuple[Array, Array]] = []
    fitted = accepted = np.zeros((m, 1 + d, k))
    complete = np.ones(m, dtype=np.bool_)
    number = 0
    for monomials in ([np.ones((m, k))], along, products):
        for f in monomials:
            here = np.zeros((m, 1 + d))
            if number <= d:  # the others have neither value nor slope at the origin
                here[:, number] = 1.0
            number += 1
            size = np.einsum("mk,mk,mk->m", weights, f, f)
            for _ in range(2):  # again, for rounding
                for g, g_here in orthonormal:
                    part = np.einsum("mk,mk,mk->m", weights, f, g)
                    f, here = f - part[:, None] * g, here - part[:, None] * g_here
            left = np.einsum("mk,mk,mk->m", weights, f, f)
            known = left > _DETERMINED * size
            complete &= known
            scale = np.where(known, 1.0 / np.sqrt(np.where(known, left, 1.0)), 0.0)[:, None]
            f, here = f * scale, here * scale
            orthonormal.append((f, here))
            fitted = fitted + here[:, :, None] * (weights * f)[:, None, :]
        safe = np.abs(fitted[:, 0]).sum(axis=1) <= _LARGEST_SUM
        complete &= safe
        accepted = np.where(safe[:, None, None], fitted, accepted)
    return accepted, complete
