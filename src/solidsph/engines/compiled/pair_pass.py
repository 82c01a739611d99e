"""A pass over pairs, by bundles and threads: what every pair gives to both its ends."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed.lanes import lane_operations
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import LANES


@cache
def pair_pass(
    of_pair: Any, given: int, values: int, found: int, together: bool, threaded: bool
) -> Any:
    """Compiled (shares, pairs, fields, sums, out), which fills `out`.

    Args:
        of_pair: compiled (a, b, values, bits) -> what a pair adds to its first end and to its
            second; a and b are what the ends have of the fields. They are lanes for bundles, of
            which those without a bit must add nothing.
        given: planes of the fields.
        values: numbers of a pair.
        found: planes of sums.
        together: whether `of_pair` takes lanes.
        threaded: whether there are several threads.
    """
    get, get_1 = (lane_operations("float64", width, given).get for width in (LANES, None))
    values_of = lane_operations("float64", None, values).get
    # Sums are read, added to and written, as lanes and as numbers.
    _, _, zeros, _, _, _, add, put_sum, get_sum = lane_operations("float64", LANES, found)
    *_, add_1, put_sum_1, get_sum_1 = lane_operations("float64", None, found)

    # Arrays one by one: to take them from a tuple for every group would count references.
    @njit(error_model="numpy")
    def of_bundles(begin, end, bundles, numbers, fields, p, sums, size, at):
        stride = len(fields) // given
        mine, own = get(fields, p, stride), zeros()
        for m in range(begin, end):
            offset = np.intp(bundles[m, 0])
            other = get(fields, p + offset, stride)
            a, b = of_pair(mine, other, values_of(numbers, m * values, 1), bundles[m, 1])
            own = add(own, a)
            put_sum(sums, at + offset, size, add(get_sum(sums, at + offset, size), b))
        put_sum(sums, at, size, add(get_sum(sums, at, size), own))

    @njit(error_model="numpy")
    def of_singles(begin, end, singles, numbers, fields, sums, size, shift):
        stride = len(fields) // given
        for m in range(begin, end):
            p, q = np.intp(singles[m, 0]), np.intp(singles[m, 1])
            mine, other = get_1(fields, p, stride), get_1(fields, q, stride)
            a, b = of_pair(mine, other, values_of(numbers, m * values, 1), 1)
            put_sum_1(sums, p + shift, size, add_1(get_sum_1(sums, p + shift, size), a))
            put_sum_1(sums, q + shift, size, add_1(get_sum_1(sums, q + shift, size), b))

    @njit(parallel=threaded)
    def sweep(shares, pairs, fields, sums):
        starts, bundles, numbers = pairs.starts, pairs.bundles, pairs.values
        alone, singles, own = pairs.single_starts, pairs.singles, pairs.single_values
        for t in prange(len(shares)):
            first, end, low, high, before = shares[t]
            begin, size = found * before, high - low
            sums[begin : begin + found * size] = 0.0
            shift = begin - low
            if together:  # a constant of the compilation
                for group in range(first, end):
                    a, b, p = starts[group], starts[group + 1], LANES * group
                    of_bundles(a, b, bundles, numbers, fields, p, sums, size, p + shift)
            if end > first:
                of_singles(alone[first], alone[end], singles, own, fields, sums, size, shift)

    @njit(parallel=threaded)
    def total(shares, sums, out):
        threads, stride = len(shares), len(out) // found
        for t in prange(threads):
            start, stop = t * stride // threads, (t + 1) * stride // threads
            for plane in range(found):
                out[plane * stride + start : plane * stride + stop] = 0.0
                for share in range(threads):
                    low, high = shares[share, 2], shares[share, 3]
                    place = found * shares[share, 4] + plane * (high - low) - low
                    for p in range(max(start, low), min(stop, high)):
                        out[plane * stride + p] += sums[place + p]

    @njit
    def run(shares, pairs, fields, sums, out):
        sweep(shares, pairs, fields, sums)
        total(shares, sums, out)

    return run
