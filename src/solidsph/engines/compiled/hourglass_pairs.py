"""What near pairs give for the hourglass energy: forces, and stresses of the gradient."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from solidsph.engines.compiled.fixed.lane_arithmetic import chosen
from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.pair_bundles import PairBundles, pair_bundles, sums_for
from solidsph.engines.compiled.pair_pass import pair_pass
from solidsph.interfaces.hourglass_energy import HourglassPairs
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.arrays import Array, Indices


class NearPairs(NamedTuple):
    """Arrays of the sums over the near pairs of one body."""

    pairs: PairBundles  # with c_ab and half of X_ab
    shares: Indices  # of threads
    jets: Array  # in planes: u, then H
    pulls: Array  # in planes: force, then stress S
    sums: Array  # of every thread, in planes

    @classmethod
    def of(cls, near: HourglassPairs, threads: int) -> NearPairs:
        """The arrays for these pairs."""
        table, offsets = near.table, near.offsets
        values = np.column_stack([near.weights, 0.5 * offsets])
        pairs = pair_bundles(PairTable(table.starts, table.columns, values))
        d = offsets.shape[1]
        count, shares = d + d * d, pairs.shares(threads)
        jets, pulls = np.zeros((2, count * pairs.padded))
        return cls(pairs, shares, jets, pulls, sums_for(shares, count))

    def tensors(self, planes: Array) -> Array:
        """H among the jets or S among the pulls, (d, d, n and more)."""
        count = len(planes) // self.pairs.padded
        d = {2: 1, 6: 2, 12: 3}[count]
        return planes.reshape(count, -1)[d:].reshape(d, d, -1)


@cache
def near_pass(dimension: int, threaded: bool) -> Any:
    """Compiled (shares, pairs, jets, sums, pulls)."""
    d = dimension
    return pair_pass(_OF_PAIR[d], d + d * d, 1 + d, d + d * d, True, threaded)


# What a pair (a, b) adds to force and stress of a, and to those of b. Forces are opposite, and both
# stresses are c e (x) X / 2, as both e and X are opposite from the other end.


@njit
def _error(a, b, i, h):
    """Component i of e_ab, from jets and half of X_ab."""
    d = len(h)
    at = d + d * i
    error = a[i] - b[i] + (a[at] + b[at]) * h[0]
    if d > 1:
        error = error + (a[at + 1] + b[at + 1]) * h[1]
    if d > 2:
        error = error + (a[at + 2] + b[at + 2]) * h[2]
    return error


@njit
def _of_pair_1(a, b, values, bits):
    c, h = values[0], values[1:]
    x = chosen(c * _error(a, b, 0, h), bits)
    S = x * h[0]
    return (-1.0 * x, S), (x, S)


@njit
def _of_pair_2(a, b, values, bits):
    c, h = values[0], values[1:]
    x = chosen(c * _error(a, b, 0, h), bits)
    y = chosen(c * _error(a, b, 1, h), bits)
    S = (x * h[0], x * h[1], y * h[0], y * h[1])
    return (-1.0 * x, -1.0 * y) + S, (x, y) + S  # noqa: RUF005


@njit
def _of_pair_3(a, b, values, bits):
    c, h = values[0], values[1:]
    x = chosen(c * _error(a, b, 0, h), bits)
    y = chosen(c * _error(a, b, 1, h), bits)
    z = chosen(c * _error(a, b, 2, h), bits)
    S = (x * h[0], x * h[1], x * h[2], y * h[0], y * h[1], y * h[2], z * h[0], z * h[1], z * h[2])
    return (-1.0 * x, -1.0 * y, -1.0 * z) + S, (x, y, z) + S  # noqa: RUF005


_OF_PAIR = {1: _of_pair_1, 2: _of_pair_2, 3: _of_pair_3}
