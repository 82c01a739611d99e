"""The compiled loop over pairs of a relaxation."""

from __future__ import annotations

import numpy as np

from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph_builtin.discretisations._relaxation import REACH, pull

_pull = njit(pull)


@njit
def add_forces(
    x: Array, sizes: Array, moves: Mask, starts: Indices, columns: Indices, way: Array
) -> None:
    """Add the forces between pairs in rows to those on each particle, `way` (n, d), where one of a
    pair `moves` (n,)."""
    n, d = x.shape
    away = np.empty(d)
    for p in range(n):
        for k in range(starts[p], starts[p + 1]):
            q = columns[k]
            if not (moves[p] or moves[q]):
                continue
            square = 0.0
            for c in range(d):
                away[c] = x[q, c] - x[p, c]
                square += away[c] * away[c]
            reach = 0.5 * REACH * (sizes[p] + sizes[q])
            if square < reach * reach:
                force = _pull(np.sqrt(square) / reach) / reach
                for c in range(d):
                    way[q, c] += force * away[c]
                    way[p, c] -= force * away[c]
