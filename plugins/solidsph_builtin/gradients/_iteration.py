"""The sums of `consistent` for many particles, by conjugate gradients over the fixed pairs.

A factorisation couples neighbours of neighbours: in space some 600 particles a particle. Here each
step is two passes over the pairs, and nothing is stored but a small matrix a particle.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs, row_starts
from solidsph.model.particles import Particles
from solidsph_builtin.gradients._softening import softening
from solidsph_builtin.gradients.quadratic import closeness

# Eigenvalues of a moment matrix below this part of the largest belong to functions that the
# neighbours do not determine.
_DEPENDENT = 1e-10
_SMALLEST = 1e-300

# The largest sum that may be left, as a part of the largest that was missing, and the most steps, by
# dimension. In space a hundred leave a few hundredths, and the torque of a bar is as exact as with
# none left, to a thousandth.
_LEFT = 1e-2
_MOST_STEPS = {1: 1000, 2: 1000, 3: 100}


def solved(
    pairs: Pairs,
    kernel_gradients: Array,
    particles: Particles,
    active: Mask,
    degree: int,
    length: float,
    missing: Array,
) -> Array:
    """Multipliers (n, 1 + d, d) whose change of the weights adds `missing` (n, 1 + d, d).

    Args:
        pairs: all pairs of the body (m,).
        kernel_gradients: of the pairs, (m, d).
        particles: of the body.
        active: those between which weights change, (n,).
        degree: of the polynomials whose gradients stay.
        length: unit of the offsets that L is multiplied by [m].
        missing: from the sums, (n, 1 + d, d).
    """
    d, V = particles.dimension, particles.volumes
    moments, diagonal_blocks, product = _passes(d, degree)
    close = closeness(kernel_gradients, pairs.distances)
    kept = active[pairs.rows] & active[pairs.columns] & (close > 0.0)
    sums = (
        row_starts(np.bincount(pairs.rows[kept], minlength=particles.count)),
        pairs.columns[kept].astype(np.int32),
        particles.positions,
        close[kept],
        particles.cells,
        V,
        length,
    )
    tests = _inverse(moments(*sums))
    blocks = diagonal_blocks(*sums, tests)
    surface = np.zeros(particles.count, dtype=np.bool_)
    for face in particles.faces.values():
        surface[face.particles] = True
    diagonal = np.einsum("nii->ni", blocks)
    soft = softening(diagonal[active], surface[active])
    diagonal[active] += soft
    diagonal[~active] = 1.0
    all_soft = np.zeros(diagonal.shape)
    all_soft[active] = soft
    wanted = np.where(active[:, None, None], missing, 0.0)
    return _conjugate_gradients(
        lambda x: product(*sums, tests, x) + all_soft[:, :, None] * x,
        np.linalg.inv(blocks),
        wanted,
        _MOST_STEPS[d],
    )


def _inverse(moments: Array) -> Array:
    """Inverse of symmetric matrices (n, k, k), zero where they are singular."""
    sizes, directions = np.linalg.eigh(moments)
    known = sizes > _DEPENDENT * np.maximum(sizes[:, -1:], _SMALLEST)
    scaled = directions * np.where(known, 1.0 / np.where(known, sizes, 1.0), 0.0)[:, None, :]
    inverse: Array = scaled @ directions.transpose(0, 2, 1)
    return inverse


def _conjugate_gradients(
    product: Callable[[Array], Array], inverse: Array, wanted: Array, steps: int
) -> Array:
    """The x (n, k, d) for which `product` of x is about `wanted`, each of the d by itself.

    `inverse` (n, k, k) is that of the diagonal blocks.
    """
    largest = float(np.abs(wanted).max())
    x, r = np.zeros_like(wanted), wanted.copy()
    z = inverse @ r
    p, along = z.copy(), np.sum(r * z, axis=(0, 1))
    for _ in range(steps):
        if np.abs(r).max() <= _LEFT * largest:
            break
        gained = product(p)
        step = along / np.maximum(np.sum(p * gained, axis=(0, 1)), _SMALLEST)
        x += step * p
        r -= step * gained
        z = inverse @ r
        now = np.sum(r * z, axis=(0, 1))
        p = z + now / np.maximum(along, _SMALLEST) * p
        along = now
    return x


@cache
def _passes(dimension: int, degree: int) -> tuple[Any, Any, Any]:
    """Compiled passes over pairs: moments, diagonal blocks, and the product with multipliers."""
    d = dimension
    k = d + d * (d + 1) // 2 if degree > 1 else d

    @njit
    def functions(x, b):
        for i in range(d):
            b[i] = x[i]
        if k > d:
            at = d
            for i in range(d):
                for j in range(i, d):
                    b[at] = x[i] * x[j]
                    at += 1

    @njit
    def moments(starts, columns, X, close, cells, V, length):
        n = len(starts) - 1
        out = np.zeros((n, k, k))
        for p in range(n):
            x, b = np.empty(d), np.empty(k)
            for m in range(starts[p], starts[p + 1]):
                q = columns[m]
                w = close[m] * cells[q]
                if w == 0.0:
                    continue
                for i in range(d):
                    x[i] = (X[q, i] - X[p, i]) / length
                functions(x, b)
                for i in range(k):
                    for j in range(k):
                        out[p, i, j] += w * b[i] * b[j]
        return out

    @njit
    def blocks(starts, columns, X, close, cells, V, length, tests):
        n = len(starts) - 1
        out = np.zeros((n, 1 + d, 1 + d))
        for p in range(n):
            x, b, t, y = np.empty(d), np.empty(k), np.zeros(k), np.empty(1 + d)
            total = 0.0
            for m in range(starts[p], starts[p + 1]):
                q = columns[m]
                if close[m] == 0.0:
                    continue
                for i in range(d):
                    x[i] = (X[q, i] - X[p, i]) / length
                functions(x, b)
                w = close[m] * cells[q]
                total += w
                for i in range(k):
                    t[i] += w * b[i]
                # The pair as (q, p), in the row of q.
                for i in range(d):
                    x[i] = -x[i]
                functions(x, b)
                w = close[m] * cells[p]
                kept = 0.0
                for i in range(k):
                    for j in range(k):
                        kept += b[i] * tests[q, i, j] * b[j]
                change = V[q] ** 2 * w * (1.0 - w * kept)
                y[0] = 1.0
                for i in range(d):
                    y[1 + i] = -x[i]
                for i in range(1 + d):
                    for j in range(1 + d):
                        out[p, i, j] += change * y[i] * y[j]
            kept = 0.0
            for i in range(k):
                for j in range(k):
                    kept += t[i] * tests[p, i, j] * t[j]
            out[p, 0, 0] += V[p] ** 2 * (total - kept)
        return out

    @njit
    def product(starts, columns, X, close, cells, V, length, tests, l):
        n = len(starts) - 1
        kept = np.empty((n, k, d))
        for p in range(n):
            x, b, t = np.empty(d), np.empty(k), np.zeros((k, d))
            for m in range(starts[p], starts[p + 1]):
                q = columns[m]
                w = close[m] * cells[q]
                if w == 0.0:
                    continue
                for i in range(d):
                    x[i] = (X[q, i] - X[p, i]) / length
                functions(x, b)
                for c in range(d):
                    y = l[q, 0, c] - l[p, 0, c]
                    for i in range(d):
                        y -= l[q, 1 + i, c] * x[i]
                    for i in range(k):
                        t[i, c] += w * b[i] * y
            for i in range(k):
                for c in range(d):
                    s = 0.0
                    for j in range(k):
                        s += tests[p, i, j] * t[j, c]
                    kept[p, i, c] = s
        out = np.zeros((n, 1 + d, d))
        for p in range(n):
            x, b = np.empty(d), np.empty(k)
            own = V[p] ** 2
            for m in range(starts[p], starts[p + 1]):
                q = columns[m]
                if close[m] == 0.0:
                    continue
                for i in range(d):
                    x[i] = (X[q, i] - X[p, i]) / length
                functions(x, b)
                w = own * close[m] * cells[q]
                for c in range(d):
                    y = l[q, 0, c] - l[p, 0, c]
                    for i in range(d):
                        y -= l[q, 1 + i, c] * x[i]
                    for i in range(k):
                        y -= b[i] * kept[p, i, c]
                    out[p, 0, c] -= w * y
                # The pair as (q, p), in the row of q.
                for i in range(d):
                    b[i] = -b[i]
                w = V[q] ** 2 * close[m] * cells[p]
                for c in range(d):
                    y = l[p, 0, c] - l[q, 0, c]
                    for i in range(d):
                        y += l[p, 1 + i, c] * x[i]
                    for i in range(k):
                        y -= b[i] * kept[q, i, c]
                    out[p, 0, c] += w * y
                    for i in range(d):
                        out[p, 1 + i, c] += w * y * x[i]
        return out

    return moments, blocks, product
