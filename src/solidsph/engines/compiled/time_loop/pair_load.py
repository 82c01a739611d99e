"""Forces of pairs in the compiled loop: those of a bundle by one call of the formula."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed.lane_arithmetic import chosen
from solidsph.engines.compiled.fixed.lanes import lane_operations
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import LANES, PairBundles, pair_bundles
from solidsph.engines.compiled.planes import planes
from solidsph.engines.compiled.vectors import moved
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.arrays import Array, Indices


class PairArrays(NamedTuple):
    """What the sums of one load need."""

    reference: Array  # (n, d) X [m]
    pairs: PairBundles
    # (t, 5) per thread: first group and end of its groups, first particle and end of those that
    # they reach, and where its sums begin
    table: Indices
    moving: Array  # in planes: positions [m], then velocities [m/s]; lanes may overrun the last
    sums: Array  # in planes, for every thread and the particles that it reaches [N]


def pair_arrays(table: PairTable, reference: Array, threads: int, *, together: bool) -> PairArrays:
    """The arrays of a load with these pairs between particles at `reference` (n, d) [m]."""
    pairs = pair_bundles(table, together=together)
    d = reference.shape[1]
    done = np.concatenate([[0.0], np.cumsum(pairs.costs())])
    edges = np.searchsorted(done, done[-1] * np.arange(threads + 1) / threads)
    reach, shares, size = pairs.reach(), np.zeros((threads, 5), dtype=np.intp), 0
    for share, (first, end) in enumerate(pairwise(edges.tolist())):
        if first < end:
            low, high = LANES * first, int(reach[first:end].max())
            shares[share] = first, end, low, high, size
            size += d * (high - low)
    stride = LANES * len(pairs.starts)
    return PairArrays(reference, pairs, shares, np.zeros(2 * d * stride), np.zeros(size))


@cache
def pair_sweep(pull: Any, dimension: int, count: int, together: bool, threaded: bool) -> Any:
    """Compiled (arrays, u (n, d), v (n, d), forces (n, d)), for a compiled formula `pull` of
    `count` values, which takes lanes if pairs are taken `together`."""
    d = dimension
    get, put = planes(d, LANES)
    get_1, put_1 = planes(d)
    values_of, zeros = planes(count).get, lane_operations("float64", LANES, d).zeros

    @njit(parallel=threaded)
    def place(threads, X, u, v, moving):
        n, stride = len(X), len(moving) // (2 * d)
        for t in prange(threads):
            for p in range(t * n // threads, (t + 1) * n // threads):
                for i in range(d):
                    moving[i * stride + p] = X[p, i] + u[p, i]
                    moving[(d + i) * stride + p] = v[p, i]

    # Arrays one by one: to take them from a tuple for every group would count references.
    @njit(error_model="numpy")
    def of_bundles(begin, end, bundles, values, moving, p, sums, size, at):
        stride = len(moving) // (2 * d)
        x, v, own = get(moving, stride, p), get(moving, stride, p + d * stride), zeros()
        for m in range(begin, end):
            offset = np.intp(bundles[m, 0])
            way = moved(get(moving, stride, p + offset), -1.0, x)
            velocity = moved(get(moving, stride, p + offset + d * stride), -1.0, v)
            pulled = chosen(pull(way, velocity, values_of(values, 1, m * count)), bundles[m, 1])
            own = moved(own, pulled, way)
            other = get(sums, size, at + offset)
            put(sums, size, at + offset, moved(other, -1.0 * pulled, way))
        put(sums, size, at, moved(get(sums, size, at), 1.0, own))

    @njit(error_model="numpy")
    def of_singles(begin, end, singles, values, moving, sums, size, shift):
        stride = len(moving) // (2 * d)
        for m in range(begin, end):
            p, q = np.intp(singles[m, 0]), np.intp(singles[m, 1])
            way = moved(get_1(moving, stride, q), -1.0, get_1(moving, stride, p))
            v = get_1(moving, stride, p + d * stride)
            velocity = moved(get_1(moving, stride, q + d * stride), -1.0, v)
            pulled = pull(way, velocity, values_of(values, 1, m * count))
            put_1(sums, size, p + shift, moved(get_1(sums, size, p + shift), pulled, way))
            put_1(sums, size, q + shift, moved(get_1(sums, size, q + shift), -pulled, way))

    @njit(parallel=threaded)
    def sweep(table, pairs, moving, sums):
        starts, bundles, values = pairs.starts, pairs.bundles, pairs.values
        single_starts, singles, single_values = (
            pairs.single_starts,
            pairs.singles,
            pairs.single_values,
        )
        for t in prange(len(table)):
            first, end, low, high, begin = table[t]
            size, shift = high - low, begin - low
            sums[begin : begin + d * size] = 0.0
            for group in range(first, end):
                a, b, p = starts[group], starts[group + 1], LANES * group
                if together:
                    of_bundles(a, b, bundles, values, moving, p, sums, size, p + shift)
            if end > first:
                a, b = single_starts[first], single_starts[end]
                of_singles(a, b, singles, single_values, moving, sums, size, shift)

    @njit(parallel=threaded)
    def total(table, sums, forces):
        n, threads = len(forces), len(table)
        for t in prange(threads):
            start, stop = t * n // threads, (t + 1) * n // threads
            forces[start:stop] = 0.0
            for share in range(threads):
                low, high, begin = table[share, 2:]
                for p in range(max(start, low), min(stop, high)):
                    for i in range(d):
                        forces[p, i] += sums[begin + i * (high - low) + p - low]

    @njit
    def forces(arrays, u, v, out):
        place(len(arrays.table), arrays.reference, u, v, arrays.moving)
        sweep(arrays.table, arrays.pairs, arrays.moving, arrays.sums)
        total(arrays.table, arrays.sums, out)

    return forces
