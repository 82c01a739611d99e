"""Compiled passes over pairs for the system of `consistent`."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from solidsph.engines.compiled.jit import njit
from solidsph_builtin.gradients._local_fits import factors_of

# Sums in any order: they are vectorised.
_FAST = {"reassoc", "contract", "nsz"}

# Rows are filled up with pairs of no weight to a multiple of this, for whole vectors.
_WHOLE = 8


class Sums(NamedTuple):
    """What the passes read."""

    starts: Any  # (n + 1,)
    columns: Any  # (m,)
    positions: Any  # (n, d) [m]
    weights: Any  # (m,) closeness times the cell of the neighbour
    shares: Any  # (n,) V^2 s [m^2d]
    inverses: Any  # (n, k, k) of the moments of the functions that keep their gradient
    units: Any  # (n,) of the offsets in these functions [m]
    length: float  # unit of the offsets that L is multiplied by [m]
    # (s, 4) first row and end of each slice of the rows, first particle that they reach and end
    slices: Any


class Passes(NamedTuple):
    """Compiled passes."""

    diagonal_blocks: Any  # (sums) -> (n, 1 + d, 1 + d)
    # (sums, multipliers (n, 1 + d, d)) -> what they add to the sums, the same shape;
    # of multipliers (n, 1, d), l alone, to the sums without their first moments.
    product: Any
    # (sums, particles) -> the rows that change and that are or have one of these.
    rows_beside: Any
    # (sums, rows (r,), places (n,), block (m, m)): block += what these rows add to the part of the
    # matrix of l alone that couples the particles with a place in the block, >= 0; its lower
    # triangle. Places ascend with the numbers of particles.
    add_block: Any
    # (sums, rows (r,), functions of the particles (n, c) by their rows' starts, columns and values,
    # matrix (c, c)): matrix += that of l alone between the functions, from these rows.
    add_functions: Any
    # (matrix (m, m), out): its lower triangle, row by row.
    pack: Any
    # (ends (b + 1,) of the blocks among their members, members, the packed Cholesky factors of
    # their matrices one after the other, r (n, d), z (n, d)): z += the solutions of all blocks.
    add_solutions: Any


@cache
def passes(dimension: int, degree: int, threaded: bool) -> Passes:
    """The passes for functions of the first or second `degree` that keep their gradient.

    Results do not depend on the number of threads.
    """
    d = dimension
    # In the order of the inverses; an array, since there may be none.
    factors = np.array(factors_of(d, degree), dtype=np.intp).reshape(-1, 2)
    k = d + len(factors)

    # The pairs of one particle stand side by side in `w`, `x` and `b`, for loops over vectors.
    @njit
    def scratch(starts):
        longest = 0
        for p in range(len(starts) - 1):
            longest = max(longest, starts[p + 1] - starts[p])
        longest = (longest + _WHOLE - 1) // _WHOLE * _WHOLE
        return np.zeros(longest), np.zeros((d, longest)), np.zeros((k, longest))

    @njit(fastmath=_FAST)
    def row(sums, p, w, x, b):
        begin = sums.starts[p]
        count = sums.starts[p + 1] - begin
        whole = (count + _WHOLE - 1) // _WHOLE * _WHOLE
        X, scale = sums.positions, 1.0 / sums.length
        own = sums.length / sums.units[p]
        for m in range(count):
            q = sums.columns[begin + m]
            w[m] = sums.weights[begin + m]
            for i in range(d):
                x[i, m] = (X[q, i] - X[p, i]) * scale
        for m in range(count, whole):
            w[m] = 0.0
        for i in range(d):
            for m in range(whole):
                b[i, m] = own * x[i, m]
        for at in range(d, k):
            i, j = factors[at - d, 0], factors[at - d, 1]
            for m in range(whole):
                b[at, m] = b[i, m] * b[j, m]
        return begin, count, whole

    @njit(fastmath=_FAST)
    def diagonal_blocks(sums):
        n = len(sums.starts) - 1
        out = np.zeros((n, 1 + d, 1 + d))
        w, x, b = scratch(sums.starts)
        y, t = np.empty(1 + d), np.empty(k)
        for p in range(n):
            if sums.shares[p] == 0.0:
                continue
            begin, count, _ = row(sums, p, w, x, b)
            own, inverse = sums.shares[p], sums.inverses[p]
            t[:] = 0.0
            total = 0.0
            y[0] = 1.0
            for m in range(count):
                q = sums.columns[begin + m]
                kept = 0.0
                for i in range(k):
                    t[i] += w[m] * b[i, m]
                    for j in range(k):
                        kept += b[i, m] * inverse[i, j] * b[j, m]
                total += w[m]
                change = own * w[m] * (1.0 - w[m] * kept)
                for i in range(d):
                    y[1 + i] = -x[i, m]
                for i in range(1 + d):
                    for j in range(1 + d):
                        out[q, i, j] += change * y[i] * y[j]
            for i in range(k):
                for j in range(k):
                    total -= t[i] * inverse[i, j] * t[j]
            out[p, 0, 0] += own * total
        return out

    # What the rows from `first` to `end` add to particles from `low` on.
    @njit(fastmath=_FAST)
    def add_rows(sums, multipliers, first, end, low, out):
        alone = multipliers.shape[1] == 1
        w, x, b = scratch(sums.starts)
        y, t, part = np.zeros((d, len(w))), np.empty(k), np.empty(k)
        for p in range(first, end):
            if sums.shares[p] == 0.0:
                continue
            begin, count, whole = row(sums, p, w, x, b)
            for m in range(count):
                q = sums.columns[begin + m]
                for c in range(d):
                    value = multipliers[q, 0, c] - multipliers[p, 0, c]
                    if not alone:
                        for i in range(d):
                            value -= multipliers[q, 1 + i, c] * x[i, m]
                    y[c, m] = value
            for c in range(d):
                yc = y[c]
                for m in range(whole):
                    yc[m] *= w[m]
                for i in range(k):
                    bi, value = b[i], 0.0
                    for m in range(whole):
                        value += bi[m] * yc[m]
                    t[i] = value
                for i in range(k):
                    value = 0.0
                    for j in range(k):
                        value += sums.inverses[p, i, j] * t[j]
                    part[i] = value
                total = 0.0
                for m in range(whole):
                    kept = 0.0
                    for i in range(k):
                        kept += part[i] * b[i, m]
                    value = sums.shares[p] * (yc[m] - w[m] * kept)
                    yc[m] = value
                    total += value
                out[p - low, 0, c] -= total
            for m in range(count):
                q = sums.columns[begin + m] - low
                for c in range(d):
                    value = y[c, m]
                    out[q, 0, c] += value
                    if not alone:
                        for i in range(d):
                            out[q, 1 + i, c] -= value * x[i, m]

    @njit(parallel=threaded)
    def add_slices(sums, multipliers, ends, parts):
        for s in prange(len(ends)):
            first, end, low, high = sums.slices[s]
            add_rows(sums, multipliers, first, end, low, parts[ends[s] - (high - low) : ends[s]])

    @njit
    def product(sums, multipliers):
        slices = sums.slices
        ends = np.cumsum(slices[:, 3] - slices[:, 2])
        parts = np.zeros((ends[-1], multipliers.shape[1], d))
        add_slices(sums, multipliers, ends, parts)
        out = np.zeros(multipliers.shape)
        for s in range(len(slices)):
            low, high = slices[s, 2:]
            out[low:high] += parts[ends[s] - (high - low) : ends[s]]
        return out

    @njit
    def rows_beside(sums, particles):
        rows = set()
        for p in particles:  # pairs are symmetric
            if sums.shares[p] > 0.0:
                rows.add(p)
            for m in range(sums.starts[p], sums.starts[p + 1]):
                q = np.int64(sums.columns[m])
                if sums.shares[q] > 0.0:
                    rows.add(q)
        return np.sort(np.array(list(rows)))

    # y of a row is l of the neighbours less its own. `inside` are the neighbours in the block.
    @njit(fastmath=_FAST)
    def add_block(sums, rows, places, block):
        w, x, b = scratch(sums.starts)
        inside = np.empty(len(w), np.int64)
        weighted, held = np.empty((k, len(w))), np.empty(k)
        kept, gained = np.empty(len(w)), np.empty(len(w))
        for p in rows:
            begin, count, whole = row(sums, p, w, x, b)
            own, inverse, here = sums.shares[p], sums.inverses[p], places[p]
            for i in range(k):
                for m in range(whole):
                    b[i, m] *= w[m]
            if here >= 0:
                total = 0.0
                for m in range(count):
                    total += w[m]
                for i in range(k):
                    value = 0.0
                    for m in range(whole):
                        value += b[i, m]
                    held[i] = value
                for i in range(k):
                    for j in range(k):
                        total -= held[i] * inverse[i, j] * held[j]
                block[here, here] += own * total
            members = 0
            for m in range(count):
                place = places[sums.columns[begin + m]]
                if place >= 0:
                    inside[members] = place
                    kept[members] = w[m]
                    for i in range(k):
                        weighted[i, members] = b[i, m]
                    members += 1
            for a in range(members):
                at = inside[a]
                change = own * kept[a]
                gained[: a + 1] = 0.0
                for i in range(k):
                    value = 0.0
                    for j in range(k):
                        value += inverse[i, j] * weighted[j, a]
                    value *= own
                    change -= value * held[i]
                    wi = weighted[i]
                    for c in range(a + 1):
                        gained[c] += value * wi[c]
                line = block[at]
                line[at] += own * kept[a]
                for c in range(a + 1):
                    line[inside[c]] -= gained[c]
                if here >= 0:
                    block[max(here, at), min(here, at)] -= change

    @njit(fastmath=_FAST)
    def add_functions(sums, rows, functions, matrix):
        starts, columns, values = functions
        w, x, b = scratch(sums.starts)
        t, part = np.empty(k), np.empty(k)
        # The functions beside a row, at most those of all its neighbours.
        most = 0
        for p in rows:
            total = starts[p + 1] - starts[p]
            for m in range(sums.starts[p], sums.starts[p + 1]):
                total += starts[sums.columns[m] + 1] - starts[sums.columns[m]]
            most = max(most, total)
        most = min(most, len(matrix))
        found, slots = np.empty(most, np.int64), np.full(len(matrix), -1)
        y, rest = np.zeros((most, len(w))), np.zeros((most, len(w)))
        for p in rows:
            begin, count, whole = row(sums, p, w, x, b)
            size = 0
            for m in range(-1, count):
                q = p if m < 0 else sums.columns[begin + m]
                for e in range(starts[q], starts[q + 1]):
                    if slots[columns[e]] < 0:
                        slots[columns[e]] = size
                        found[size] = columns[e]
                        y[size] = 0.0
                        size += 1
            for m in range(count):
                q = sums.columns[begin + m]
                for e in range(starts[q], starts[q + 1]):
                    y[slots[columns[e]], m] += values[e]
            for e in range(starts[p], starts[p + 1]):
                y[slots[columns[e]], :count] -= values[e]
            for a in range(size):
                slots[found[a]] = -1
                ya, ra = y[a], rest[a]
                for i in range(k):
                    value = 0.0
                    for m in range(whole):
                        value += w[m] * b[i, m] * ya[m]
                    t[i] = value
                for i in range(k):
                    value = 0.0
                    for j in range(k):
                        value += sums.inverses[p, i, j] * t[j]
                    part[i] = value
                for m in range(whole):
                    kept = ya[m]
                    for i in range(k):
                        kept -= part[i] * b[i, m]
                    ra[m] = sums.shares[p] * w[m] * kept
            for a in range(size):
                ya, line = y[a], matrix[found[a]]
                for c in range(size):
                    rc, value = rest[c], 0.0
                    for m in range(whole):
                        value += ya[m] * rc[m]
                    line[found[c]] += value

    @njit
    def pack(matrix, out):
        at = 0
        for m in range(len(matrix)):
            out[at : at + m + 1] = matrix[m, : m + 1]
            at += m + 1

    # The solution of a block from r (m, d), in its place.
    @njit(fastmath=_FAST)
    def solve(factors, x):
        first = 0
        for m in range(x.shape[1]):
            line = factors[first : first + m + 1]
            first += m + 1
            for c in range(d):
                xc, value = x[c], x[c, m]
                for j in range(m):
                    value -= line[j] * xc[j]
                xc[m] = value / line[m]
        for m in range(x.shape[1] - 1, -1, -1):
            first -= m + 1
            line = factors[first : first + m + 1]
            for c in range(d):
                xc = x[c]
                xc[m] /= line[m]
                value = xc[m]
                for j in range(m):
                    xc[j] -= line[j] * value

    # By loops, since the threads of a linear algebra library wait for each other at every block.
    @njit(parallel=threaded)
    def solve_blocks(ends, members, factors, factor_ends, r, found):
        for block in prange(len(factor_ends)):
            own = members[ends[block] : ends[block + 1]]
            x = np.empty((d, len(own)), np.float32)
            for m in range(len(own)):
                for c in range(d):
                    x[c, m] = r[own[m], c]
            end = factor_ends[block]
            solve(factors[end - len(own) * (len(own) + 1) // 2 : end], x)
            for m in range(len(own)):
                for c in range(d):
                    found[ends[block] + m, c] = x[c, m]

    @njit
    def add_solutions(ends, members, factors, r, z):
        sizes = np.diff(ends)
        found = np.empty((ends[-1], d), np.float32)
        solve_blocks(ends, members, factors, np.cumsum(sizes * (sizes + 1) // 2), r, found)
        for m in range(len(members)):
            for c in range(d):
                z[members[m], c] += found[m, c]

    return Passes(
        diagonal_blocks, product, rows_beside, add_block, add_functions, pack, add_solutions
    )
