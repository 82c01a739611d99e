"""A pass over pairs, by bundles and threads: what every pair gives to both its ends."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import prange

from solidsph.engines.compiled.fixed.lanes import lane_operations
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import LANES
from solidsph.engines.compiled.planes import planes, plus


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
    get, _ = planes(given, LANES)
    get_1, _ = planes(given)
    get_sum, put_sum = planes(found, LANES)
    get_sum_1, put_sum_1 = planes(found)
    values_of, add = planes(values).get, plus(found)
    zeros = lane_operations("float64", LANES, found).zeros

    # Arrays one by one: to take them from a tuple for every group would count references.
    @njit(error_model="numpy")
    def of_bundles(begin, end, bundles, numbers, fields, p, sums, size, at):
        stride = len(fields) // given
        mine, own = get(fields, stride, p), zeros()
        for m in range(begin, end):
            offset = np.intp(bundles[m, 0])
            other = get(fields, stride, p + offset)
            a, b = of_pair(mine, other, values_of(numbers, 1, m * values), bundles[m, 1])
            own = add(own, a)
            put_sum(sums, size, at + offset, add(get_sum(sums, size, at + offset), b))
        put_sum(sums, size, at, add(get_sum(sums, size, at), own))

    @njit(error_model="numpy")
    def of_singles(begin, end, singles, numbers, fields, sums, size, shift):
        stride = len(fields) // given
        for m in range(begin, end):
            p, q = np.intp(singles[m, 0]), np.intp(singles[m, 1])
            mine, other = get_1(fields, stride, p), get_1(fields, stride, q)
            a, b = of_pair(mine, other, values_of(numbers, 1, m * values), 1)
            put_sum_1(sums, size, p + shift, add(get_sum_1(sums, size, p + shift), a))
            put_sum_1(sums, size, q + shift, add(get_sum_1(sums, size, q + shift), b))

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
