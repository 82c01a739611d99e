"""The sums of `consistent` for many particles, by conjugate gradients over the fixed pairs.

A factorisation couples neighbours of neighbours: in space some 600 particles a particle. Here each
step is one pass over the pairs and one over small blocks of particles, whose factors take some 2
kilobytes a particle in space.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solidsph.engines.compiled.fixed.partition import thread_count
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs, row_starts
from solidsph.model.particles import Particles
from solidsph.system.build_log import BUILD
from solidsph_builtin.gradients._equal_rows import distinct_rows
from solidsph_builtin.gradients._local_fits import LocalFits, portions
from solidsph_builtin.gradients._overlapping_blocks import OverlappingBlocks
from solidsph_builtin.gradients._passes import Sums, passes
from solidsph_builtin.gradients._softening import softening
from solidsph_builtin.gradients._splines import Splines

_SMALLEST = 1e-300

# The largest sum that may be left, as a part of the largest that was missing: of all, and then of
# the sums without their first moments. With 0.1 the errors of balls, twisted bars and beams are
# those with 0.001.
_LEFT, _LEFT_OF_SUMS = 0.1, 1e-7
# The same of the sums where the spacing varies. A uniform stress in a box with spacings from 1 to 2
# is then balanced to 1e-9 of the largest load, with 1e-7 to 1e-7; it takes as long.
_LEFT_OF_GRADED = 3e-10

# Steps with the diagonal alone, at most: these are enough for boxes. Then splines help: in a ball
# of 37 000 particles 86 steps leave 0.09 with them, 96 leave 0.58 with blocks beside them.
_FIRST = 30
# Steps that follow, and those for the sums alone, at most: a number, and a number times the pairs,
# for some ten seconds. A cube of 46 particles a side takes 60 of the last for 1e-4.
_MOST, _LEAST_OF_SUMS = 300, 30
_PAIR_STEPS, _PAIR_STEPS_OF_SUMS = 2e8, 3e8

# Slices of the rows, each with sums of its own.
_SLICES = 8
# Nanoseconds that a pair takes in a pass, roughly.
_PER_PAIR = 20


def solved(
    pairs: Pairs,
    close: Array,
    particles: Particles,
    free: Array,
    degree: int,
    length: float,
    missing: Array,
    surface: Mask,
    sizes: Array,
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
        sizes: spacings in units of the length, (n,).
    """
    d = particles.dimension
    threads = thread_count(_PER_PAIR * pairs.count)
    compiled = passes(d, degree, threads > 1)
    sums = _sums(pairs, close, particles, free, degree, length)
    blocks = compiled.diagonal_blocks(sums)
    diagonal = np.einsum("nii->ni", blocks)
    soft = softening(diagonal, surface, sizes)
    diagonal += soft

    def softened(x: Array) -> Array:
        result: Array = compiled.product(sums, x) + soft[:, :, None] * x
        return result

    def of_sums_alone(x: Array) -> Array:
        result: Array = compiled.product(sums, x) + soft[:, :1, None] * x
        return result

    reached = np.flatnonzero(diagonal[:, 0] > 0.0)
    diagonal[diagonal[:, 0] == 0.0, 0] = 1.0  # sums that no change of the weights reaches
    inverses = np.linalg.inv(blocks)
    splines = Splines.of(sums, compiled, reached, soft[:, 0], particles.spacings)
    near = OverlappingBlocks.of(sums, compiled, reached, soft[:, 0], particles.spacings)

    def by_particles(r: Array) -> Array:
        result: Array = inverses @ r
        return result

    def by_splines(r: Array) -> Array:
        z = by_particles(r)
        z[:, 0] += splines.solution(r[:, 0])
        return z

    def sums_by_blocks(r: Array) -> Array:
        z = splines.solution(r[:, 0])
        near.add_solutions(r[:, 0], z)
        return z[:, None]

    count = len(sums.columns)
    most = min(_MOST, int(_PAIR_STEPS / count))
    most_of_sums = int(np.clip(_PAIR_STEPS_OF_SUMS / count, _LEAST_OF_SUMS, _MOST))
    largest = float(np.abs(missing).max())
    # Where the spacing varies, the sums of a fine part are smaller than the largest.
    finest = float(sizes.min())
    part = _LEFT_OF_GRADED * finest ** (d - 1) if finest < 1.0 else _LEFT_OF_SUMS
    allowed, exact = _LEFT * largest, part * largest
    multipliers = _conjugate_gradients(softened, by_particles, missing, allowed, _FIRST)
    left = missing - softened(multipliers)
    multipliers += _conjugate_gradients(softened, by_splines, left, allowed, most)
    # The sums themselves must be right to more digits, for uniform stresses to be in balance.
    left = (missing - softened(multipliers))[:, :1]
    multipliers[:, :1] += _conjugate_gradients(
        of_sums_alone, sums_by_blocks, left, exact, most_of_sums
    )
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
    starts = row_starts(np.bincount(pairs.rows[kept], minlength=particles.count))
    return Sums(
        starts,
        columns.astype(np.int32),
        particles.positions,
        close[kept] * particles.cells[columns],
        particles.volumes**2 * free,
        (root @ root.transpose(0, 2, 1))[kinds],
        np.concatenate(units)[kinds],
        length,
        _slices(starts, columns, free > 0.0),
    )


def _slices(starts: Indices, columns: Indices, counts: Mask) -> Indices:
    """Slices of the rows with as many pairs each of those that count (n,), as `Sums` has them."""
    rows = np.flatnonzero(counts)
    done = np.cumsum(np.diff(starts)[rows])
    parts = np.searchsorted(done, done[-1] * np.arange(1, _SLICES) / _SLICES)
    slices = []
    for own in np.split(rows, parts):
        if own.size:
            first, end = int(own[0]), int(own[-1]) + 1
            reached = columns[starts[first] : starts[end]]
            low, high = min(first, reached.min()), max(end, reached.max() + 1)
            slices.append((first, end, low, high))
    return np.array(slices, dtype=np.intp).reshape(-1, 4)


def _conjugate_gradients(
    product: Callable[[Array], Array],
    nearly_solved: Callable[[Array], Array],
    wanted: Array,
    allowed: float,
    steps: int,
) -> Array:
    """The x (n, k, d) for which `product` of x is `wanted` up to what is `allowed`.

    `nearly_solved` is the preconditioner. Each of the d is solved by itself. On the way to the
    solution what is left may grow; the x with the least is returned.
    """
    least = float(np.abs(wanted).max())
    x, r = np.zeros_like(wanted), wanted.copy()
    best = x.copy()
    z = nearly_solved(r)
    p, along = z.copy(), np.sum(r * z, axis=(0, 1))
    for done in range(steps):
        if least <= allowed:
            break
        BUILD.debug("step %d of %d at most", done, steps)
        gained = product(p)
        cost = np.sum(p * gained, axis=(0, 1))
        # What is left of polynomials is rounding, and may cost nothing or less.
        step = np.where(cost > _SMALLEST, along / np.maximum(cost, _SMALLEST), 0.0)
        x += step * p
        r -= step * gained
        left = float(np.abs(r).max())
        if left < least:
            least, best[:] = left, x
        z = nearly_solved(r)
        now = np.sum(r * z, axis=(0, 1))
        p = z + now / np.maximum(along, _SMALLEST) * p
        along = now
    return best
