"""Compiled loops over points for moving least squares fits (`_reproducing.py` has the method)."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed.partition import thread_count
from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Indices

# Slices of the points, each with sums of its own: results do not depend on the number of threads.
_SLICES = 4
# Cells on each side of a point that are searched: they are so many times smaller than the radius.
_HALF = 2
# Nanoseconds that a point takes, roughly.
_PER_POINT = 5000


class Cells(NamedTuple):
    """Particles sorted by the cubic cell that they are in."""

    lower: Array  # (d,) corner of the first cell [m]
    width: float  # of a cell [m]
    counts: Indices  # (d,) cells along each axis
    starts: Indices  # (cells + 1,)
    order: Indices  # (n,) particles, cell by cell
    places: Array  # (n, d) of the particles in that order [m]

    @classmethod
    def of(cls, positions: Array, width: float) -> Cells:
        """Of particles at `positions` (n, d) [m]; the first and the last cells are empty."""
        lower = positions.min(axis=0) - 1.5 * width
        counts = ((positions.max(axis=0) - lower) / width).astype(np.intp) + 2
        index = ((positions - lower) / width).astype(np.intp)
        cell = np.ravel_multi_index(tuple(index.T), tuple(counts))
        order = np.argsort(cell, kind="stable")
        starts = np.searchsorted(cell[order], np.arange(np.prod(counts) + 1))
        return cls(lower, width, counts, starts, order, np.ascontiguousarray(positions[order]))


class Fits(NamedTuple):
    """What a fit is made of."""

    radius: float  # up to which particles count [m]
    powers: Indices  # (j, d) exponents of the monomials, of the lowest degree first
    sizes: Indices  # (degrees,) monomials up to each degree
    determined: float
    flat: float
    largest_sum: float
    most: int  # particles that count, at most


def cells_for_fits(positions: Array, radius: float) -> Cells:
    """The particles at `positions` (n, d) for fits with a `radius` [m]."""
    return Cells.of(positions, radius / _HALF)


def add_integrals(
    cells: Cells, fits: Fits, points: Array, weights: Array, degree: Indices, sums: Array
) -> Indices:
    """Add the integrals of the functions to `sums` (n, k).

    Args:
        cells: the particles.
        fits: how fits are made.
        points: of the quadrature, (m, d) [m].
        weights: of the points, (m, k).
        degree: of the fit at each point at most, (m,).
        sums: what is added to.

    Returns:
        The points that have no particle or too many within the radius, which are left out.
    """
    loop = _loop(points.shape[1], thread_count(_PER_POINT * len(points)) > 1)
    parts = np.zeros((_SLICES, *sums.shape))
    left = np.zeros(len(points), dtype=np.bool_)
    loop(cells, fits, points, weights, degree, parts, left)
    for part in parts:
        sums += part
    return np.flatnonzero(left)


def nearest(cells: Cells, points: Array) -> Indices:
    """The particle nearest to each of `points` (m, d), (m,); -1 if none is within the width of a
    cell."""
    found = np.empty(len(points), dtype=np.intp)
    threaded = thread_count(_PER_POINT * len(points) // 10) > 1
    _nearest_loop(points.shape[1], threaded)(cells, points, found)
    return found


def _steps_around(dimension: int, layers: int = 1) -> Indices:
    """A cell and those up to so many `layers` around it, (m, d)."""
    steps = np.meshgrid(*[np.arange(-layers, layers + 1)] * dimension, indexing="ij")
    return np.ascontiguousarray(np.stack(steps, axis=-1).reshape(-1, dimension))


@cache
def _nearest_loop(dimension: int, threaded: bool) -> Any:
    d, around = dimension, _steps_around(dimension)

    @njit(parallel=threaded)
    def loop(cells, points, found):
        for p in prange(len(points)):
            best = cells.width * cells.width
            found[p] = -1
            for step in range(len(around)):
                cell, inside = 0, True
                for i in range(d):
                    place = int((points[p, i] - cells.lower[i]) / cells.width) + around[step, i]
                    inside = inside and 0 <= place < cells.counts[i]
                    cell = cell * cells.counts[i] + place
                if inside:
                    for at in range(cells.starts[cell], cells.starts[cell + 1]):
                        square = 0.0
                        for i in range(d):
                            square += (cells.places[at, i] - points[p, i]) ** 2
                        if square < best:
                            best, found[p] = square, cells.order[at]

    return loop


@cache
def _loop(dimension: int, threaded: bool) -> Any:
    d = dimension
    rows = _steps_around(max(dimension - 1, 1), _HALF)[:: 1 if dimension > 1 else 1 + 2 * _HALF]

    @njit(error_model="numpy")
    def first_column(M, size, determined, flat, lower, pivots, known, x):
        """x[:size]: the first column of the inverse, without what earlier rows determine."""
        for j in range(size):
            pivot = M[j, j]
            for k in range(j):
                pivot -= lower[j, k] * lower[j, k] * pivots[k]
            known[j] = pivot > determined * M[j, j] and M[j, j] > flat * M[0, 0]
            pivots[j] = pivot if known[j] else 1.0
            for i in range(j + 1, size):
                if known[j]:
                    rest = M[i, j]
                    for k in range(j):
                        rest -= lower[i, k] * lower[j, k] * pivots[k]
                    lower[i, j] = rest / pivots[j]
                else:
                    lower[i, j] = 0.0
        x[0] = 1.0
        for j in range(1, size):
            total = 0.0
            for k in range(j):
                total -= lower[j, k] * x[k]
            x[j] = total
        for j in range(size):
            x[j] = x[j] / pivots[j] if known[j] else 0.0
        for j in range(size - 2, -1, -1):
            if known[j]:
                for k in range(j + 1, size):
                    x[j] -= lower[k, j] * x[k]

    @njit(error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
    def of_slice(cells, fits, points, weights, degree, begin, end, out, left):
        most, terms = fits.most, len(fits.powers)
        near, weight = np.empty(most, np.int64), np.empty(most)
        basis = np.empty((terms, most))
        M, lower = np.empty((terms, terms)), np.zeros((terms, terms))
        pivots, known, x = np.empty(terms), np.empty(terms, np.bool_), np.empty(terms)
        values = np.empty(most)
        index = np.empty(d, np.int64)
        inverse, reach = 1.0 / fits.radius, fits.radius * fits.radius
        # Each monomial is an earlier one times the place along an axis.
        before, axes = np.zeros(terms, np.int64), np.zeros(terms, np.int64)
        for j in range(1, terms):
            for i in range(d):
                if fits.powers[j, i] > 0:
                    axes[j] = i
            for k in range(j):
                same = True
                for i in range(d):
                    same = same and fits.powers[k, i] == fits.powers[j, i] - (axes[j] == i)
                if same:
                    before[j] = k
        for p in range(begin, end):
            for i in range(d):
                index[i] = np.int64(np.floor((points[p, i] - cells.lower[i]) / cells.width))
            count = 0
            for step in range(len(rows)):
                row, inside = 0, True
                for i in range(d - 1):
                    place = index[i] + rows[step, i]
                    inside = inside and 0 <= place < cells.counts[i]
                    row = row * cells.counts[i] + place
                # Along the last axis cells follow each other, as their particles do.
                first = min(max(index[d - 1] - _HALF, 0), cells.counts[d - 1])
                last = max(min(index[d - 1] + _HALF + 1, cells.counts[d - 1]), first)
                if not inside:
                    continue
                row *= cells.counts[d - 1]
                for at in range(cells.starts[row + first], cells.starts[row + last]):
                    square = 0.0
                    for i in range(d):
                        square += (cells.places[at, i] - points[p, i]) ** 2
                    if square < reach:
                        if count < most:
                            q = np.sqrt(square) * inverse
                            near[count] = cells.order[at]
                            weight[count] = (1.0 - q) ** 4 * (1.0 + 4.0 * q)
                            for i in range(d):
                                # In the place of the monomials of the first degree for now.
                                basis[1 + i, count] = (cells.places[at, i] - points[p, i]) * inverse
                        count += 1
            if count == 0 or count > most:
                left[p] = True
                continue
            for m in range(count):
                basis[0, m] = 1.0
            top = fits.sizes[degree[p]]
            if top > 1:
                for m in range(count):
                    for i in range(d):
                        x[i] = basis[1 + i, m]
                    for j in range(1, 1 + d):
                        basis[j, m] = x[axes[j]]
                for j in range(1 + d, top):
                    first, axis = before[j], 0
                    for k in range(1, 1 + d):
                        if axes[k] == axes[j]:
                            axis = k
                    for m in range(count):
                        basis[j, m] = basis[first, m] * basis[axis, m]
            for j in range(top):
                for m in range(count):
                    values[m] = weight[m] * basis[j, m]
                for k in range(j + 1):
                    total = 0.0
                    for m in range(count):
                        total += values[m] * basis[k, m]
                    M[j, k] = total
            safe = False
            for number in range(degree[p], -1, -1):
                size = fits.sizes[number]
                first_column(M, size, fits.determined, fits.flat, lower, pivots, known, x)
                for m in range(count):
                    values[m] = 0.0
                for j in range(size):
                    for m in range(count):
                        values[m] += x[j] * basis[j, m]
                total = 0.0
                for m in range(count):
                    total += abs(weight[m] * values[m])
                if total <= fits.largest_sum:
                    safe = True
                    break
            if not safe:
                continue
            for m in range(count):
                value = weight[m] * values[m]
                for c in range(weights.shape[1]):
                    out[near[m], c] += value * weights[p, c]

    @njit(parallel=threaded)
    def loop(cells, fits, points, weights, degree, parts, left):
        m = len(points)
        for s in prange(_SLICES):
            of_slice(
                cells,
                fits,
                points,
                weights,
                degree,
                s * m // _SLICES,
                (s + 1) * m // _SLICES,
                parts[s],
                left,
            )

    return loop
