"""Compiled passes over pairs for the system of `consistent`."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

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


class Passes(NamedTuple):
    """Compiled passes."""

    diagonal_blocks: Any  # (sums) -> (n, 1 + d, 1 + d)
    # (sums, multipliers (n, 1 + d, d)) -> what they add to the sums, the same shape;
    # of multipliers (n, 1, d), l alone, to the sums without their first moments.
    product: Any


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

    @njit(fastmath=_FAST)
    def product(sums, multipliers):
        n = len(sums.starts) - 1
        alone = multipliers.shape[1] == 1
        out = np.zeros(multipliers.shape)
        w, x, b = scratch(sums.starts)
        y, t, part = np.zeros((d, len(w))), np.empty(k), np.empty(k)
        for p in range(n):
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
                out[p, 0, c] -= total
            for m in range(count):
                q = sums.columns[begin + m]
                for c in range(d):
                    value = y[c, m]
                    out[q, 0, c] += value
                    if not alone:
                        for i in range(d):
                            out[q, 1 + i, c] -= value * x[i, m]
        return out

    return Passes(diagonal_blocks, product)
