"""Compiled passes over pairs for the system of `consistent`."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from solidsph.engines.compiled.jit import njit
from solidsph_builtin.gradients._local_fits import factors_of

# Sums in any order: they are vectorised.
_FAST = {"reassoc", "contract", "nsz"}


class Sums(NamedTuple):
    """What the passes read."""

    starts: Any  # (n + 1,)
    columns: Any  # (m,)
    positions: Any  # (n, d) [m]
    closeness: Any  # (m,)
    cells: Any  # (n,) [m^d]
    shares: Any  # (n,) V^2 s [m^2d]
    inverses: Any  # (n, k, k) of the moments of the functions that keep their gradient
    units: Any  # (n,) of the offsets in these functions [m]
    length: float  # unit of the offsets that L is multiplied by [m]


class Passes(NamedTuple):
    """Compiled passes."""

    diagonal_blocks: Any  # (sums) -> (n, 1 + d, 1 + d)
    product: Any  # (sums, multipliers (n, 1 + d, d)) -> what they add to the sums, the same shape


@cache
def passes(dimension: int, degree: int) -> Passes:
    """The passes for functions of the first or second `degree` that keep their gradient."""
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
        return np.empty(longest), np.empty((d, longest)), np.empty((k, longest))

    @njit(fastmath=_FAST)
    def row(sums, p, w, x, b):
        begin = sums.starts[p]
        count = sums.starts[p + 1] - begin
        X, own = sums.positions, sums.length / sums.units[p]
        for m in range(count):
            q = sums.columns[begin + m]
            w[m] = sums.closeness[begin + m] * sums.cells[q]
            for i in range(d):
                x[i, m] = (X[q, i] - X[p, i]) / sums.length
        for i in range(d):
            for m in range(count):
                b[i, m] = own * x[i, m]
        for at in range(d, k):
            i, j = factors[at - d, 0], factors[at - d, 1]
            for m in range(count):
                b[at, m] = b[i, m] * b[j, m]
        return begin, count

    @njit(fastmath=_FAST)
    def diagonal_blocks(sums):
        n = len(sums.starts) - 1
        out = np.zeros((n, 1 + d, 1 + d))
        w, x, b = scratch(sums.starts)
        y, t = np.empty(1 + d), np.empty(k)
        for p in range(n):
            if sums.shares[p] == 0.0:
                continue
            begin, count = row(sums, p, w, x, b)
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

    @njit(fastmath=_FAST)
    def product(sums, multipliers):
        n = len(sums.starts) - 1
        out = np.zeros((n, 1 + d, d))
        w, x, b = scratch(sums.starts)
        y, t = np.empty((d, len(w))), np.empty(k)
        for p in range(n):
            if sums.shares[p] == 0.0:
                continue
            begin, count = row(sums, p, w, x, b)
            for m in range(count):
                q = sums.columns[begin + m]
                for c in range(d):
                    value = multipliers[q, 0, c] - multipliers[p, 0, c]
                    for i in range(d):
                        value -= multipliers[q, 1 + i, c] * x[i, m]
                    y[c, m] = value
            own = sums.shares[p]
            for c in range(d):
                for i in range(k):
                    along = 0.0
                    for m in range(count):
                        along += w[m] * b[i, m] * y[c, m]
                    t[i] = along
                for i in range(k):
                    part = 0.0
                    for j in range(k):
                        part += sums.inverses[p, i, j] * t[j]
                    for m in range(count):
                        y[c, m] -= part * b[i, m]
                total = 0.0
                for m in range(count):
                    y[c, m] *= own * w[m]
                    total += y[c, m]
                out[p, 0, c] -= total
            for m in range(count):
                q = sums.columns[begin + m]
                for c in range(d):
                    out[q, 0, c] += y[c, m]
                    for i in range(d):
                        out[q, 1 + i, c] -= y[c, m] * x[i, m]
        return out

    return Passes(diagonal_blocks, product)
