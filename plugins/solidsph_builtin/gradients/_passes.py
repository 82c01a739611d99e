"""Compiled passes over pairs for the system of `consistent`."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from solidsph.engines.compiled.jit import njit


@cache
def passes(dimension: int, degree: int) -> tuple[Any, Any, Any]:
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
    def product(starts, columns, X, close, cells, V, length, tests, multipliers):
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
                    y = multipliers[q, 0, c] - multipliers[p, 0, c]
                    for i in range(d):
                        y -= multipliers[q, 1 + i, c] * x[i]
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
                    y = multipliers[q, 0, c] - multipliers[p, 0, c]
                    for i in range(d):
                        y -= multipliers[q, 1 + i, c] * x[i]
                    for i in range(k):
                        y -= b[i] * kept[p, i, c]
                    out[p, 0, c] -= w * y
                # The pair as (q, p), in the row of q.
                for i in range(d):
                    b[i] = -b[i]
                w = V[q] ** 2 * close[m] * cells[p]
                for c in range(d):
                    y = multipliers[p, 0, c] - multipliers[q, 0, c]
                    for i in range(d):
                        y += multipliers[p, 1 + i, c] * x[i]
                    for i in range(k):
                        y -= b[i] * kept[q, i, c]
                    out[p, 0, c] += w * y
                    for i in range(d):
                        out[p, 1 + i, c] += w * y * x[i]
        return out

    return moments, blocks, product
