"""Forces of pairs in the compiled loop."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed import lane_functions as lane_functions  # for formulas
from solidsph.engines.compiled.fixed.lane_arithmetic import chosen
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import PairBundles, pair_bundles, sums_for
from solidsph.engines.compiled.pair_pass import pair_pass
from solidsph.engines.compiled.planes import adding
from solidsph.engines.compiled.vectors import moved, times
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.arrays import Array, Indices


class PairArrays(NamedTuple):
    """What the sums of one load need."""

    reference: Array  # (n, d) X [m]
    pairs: PairBundles
    shares: Indices  # of threads
    moving: Array  # in planes: positions [m], velocities [m/s]
    sums: Array  # of every thread, in planes [N]
    pulls: Array  # in planes [N]


def pair_arrays(table: PairTable, reference: Array, threads: int, *, together: bool) -> PairArrays:
    """The arrays of a load with these pairs between particles at `reference` (n, d) [m]."""
    pairs = pair_bundles(table, together=together)
    shares, d = pairs.shares(threads), reference.shape[1]
    moving, pulls = np.zeros(2 * d * pairs.padded), np.zeros(d * pairs.padded)
    return PairArrays(reference, pairs, shares, moving, sums_for(shares, d), pulls)


@cache
def pair_sweep(pull: Any, dimension: int, count: int, together: bool, threaded: bool) -> Any:
    """Compiled (arrays, u (n, d), v (n, d), forces (n, d)), for a compiled formula `pull` of
    `count` values, which takes lanes if pairs are taken `together`."""
    d = dimension

    @njit(error_model="numpy")
    def of_pair(a, b, values, bits):
        way, velocity = moved(b[:d], -1.0, a[:d]), moved(b[d:], -1.0, a[d:])
        pulled = chosen(pull(way, velocity, values), bits)
        return times(pulled, way), times(-1.0 * pulled, way)

    add = adding(d, threaded)
    run = pair_pass(of_pair, 2 * d, count, d, together, threaded)

    @njit(parallel=threaded)
    def place(threads, X, u, v, moving):
        n, stride = len(X), len(moving) // (2 * d)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(d):
                    moving[i * stride + p] = X[p, i] + u[p, i]
                    moving[(d + i) * stride + p] = v[p, i]

    @njit
    def forces(arrays, u, v, out):
        threads = len(arrays.shares)
        place(threads, arrays.reference, u, v, arrays.moving)
        run(arrays.shares, arrays.pairs, arrays.moving, arrays.sums, arrays.pulls)
        out[:] = 0.0
        add(threads, arrays.pulls, len(arrays.pulls) // d, out)

    return forces
