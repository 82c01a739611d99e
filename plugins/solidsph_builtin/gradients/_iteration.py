"""The sums of `consistent` for many particles, by conjugate gradients over the fixed pairs.

A factorisation couples neighbours of neighbours: in space some 600 particles a particle. Here each
step is one pass over the pairs, and nothing is stored but a small matrix a particle.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs, row_starts
from solidsph.model.particles import Particles
from solidsph_builtin.gradients._equal_rows import distinct_rows
from solidsph_builtin.gradients._local_fits import LocalFits, portions
from solidsph_builtin.gradients._passes import Sums, passes
from solidsph_builtin.gradients._softening import softening

_SMALLEST = 1e-300

# The largest sum that may be left, as a part of the largest that was missing: of all, and then of
# the sums without their first moments.
_LEFT, _LEFT_OF_SUMS = 1e-2, 1e-7

# Steps, at least and at most, and pairs times steps: some seconds. The least leave 3 % of what was
# missing in a cube of 46 particles a side.
_FEWEST, _MOST = 30, 2000
_PAIR_STEPS = 5e7


def solved(
    pairs: Pairs,
    close: Array,
    particles: Particles,
    free: Array,
    degree: int,
    length: float,
    missing: Array,
    surface: Mask,
) -> Array:
    """Multipliers (n, 1 + d, d) whose change of the weights adds `missing` (n, 1 + d, d).

    Args:
        pairs: all pairs of the body (m,).
        close: their closeness (m,).
        particles: of the body.
        free: how freely the weights of a row change, (n,).
        degree: of the polynomials whose gradients stay.
        length: unit of the offsets that L is multiplied by [m].
        missing: from the sums, (n, 1 + d, d).
        surface: the particles on the surface, (n,).
    """
    d = particles.dimension
    diagonal_blocks, product = passes(d, degree)
    sums = _sums(pairs, close, particles, free, degree, length)
    blocks = diagonal_blocks(sums)
    diagonal = np.einsum("nii->ni", blocks)
    soft = softening(diagonal, surface)
    diagonal += soft
    diagonal[diagonal[:, 0] == 0.0, 0] = 1.0  # sums that no change of the weights reaches
    steps = int(np.clip(_PAIR_STEPS / len(sums.columns), _FEWEST, _MOST))

    def softened(x: Array) -> Array:
        result: Array = product(sums, x) + soft[:, :, None] * x
        return result

    def of_sums_alone(x: Array) -> Array:
        result: Array = product(sums, x) + soft[:, :1, None] * x
        return result

    multipliers = _conjugate_gradients(softened, np.linalg.inv(blocks), missing, _LEFT, steps)
    # The sums themselves must be right to more digits, for uniform stresses to be in balance.
    left = (missing - softened(multipliers))[:, :1]
    inverse = 1.0 / blocks[:, :1, :1]
    part = _LEFT_OF_SUMS * np.abs(missing).max() / max(np.abs(left).max(), _SMALLEST)
    multipliers[:, :1] += _conjugate_gradients(of_sums_alone, inverse, left, part, steps // 2)
    return multipliers


def _sums(
    pairs: Pairs, close: Array, particles: Particles, free: Array, degree: int, length: float
) -> Sums:
    roots, units = [], []
    first, kinds = distinct_rows(pairs, particles.cells)
    where, rows = pairs.chosen(first)
    weights = close[where] * particles.cells[rows.columns]
    for own, part in portions(rows):
        fits = LocalFits.of(part, weights[own], degree)
        roots.append(fits.inverse_root())
        units.append(fits.units)
    root = np.concatenate(roots)
    kept = close > 0.0
    columns = pairs.columns[kept]
    return Sums(
        row_starts(np.bincount(pairs.rows[kept], minlength=particles.count)),
        columns.astype(np.int32),
        particles.positions,
        close[kept] * particles.cells[columns],
        particles.volumes**2 * free,
        (root @ root.transpose(0, 2, 1))[kinds],
        np.concatenate(units)[kinds],
        length,
    )


def _conjugate_gradients(
    product: Callable[[Array], Array], inverse: Array, wanted: Array, part: float, steps: int
) -> Array:
    """The x (n, k, d) for which `product` of x is `wanted` but for this `part` of its largest.

    `inverse` (n, k, k) is that of the diagonal blocks. Each of the d is solved by itself. On the
    way to the solution what is left may grow; the x with the least is returned.
    """
    largest = least = float(np.abs(wanted).max())
    x, r = np.zeros_like(wanted), wanted.copy()
    best = x.copy()
    z = inverse @ r
    p, along = z.copy(), np.sum(r * z, axis=(0, 1))
    for _ in range(steps):
        if least <= part * largest:
            break
        gained = product(p)
        step = along / np.maximum(np.sum(p * gained, axis=(0, 1)), _SMALLEST)
        x += step * p
        r -= step * gained
        left = float(np.abs(r).max())
        if left < least:
            least, best[:] = left, x
        z = inverse @ r
        now = np.sum(r * z, axis=(0, 1))
        p = z + now / np.maximum(along, _SMALLEST) * p
        along = now
    return best
