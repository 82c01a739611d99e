"""Rows of pairs that are equal but for their place: on a lattice most are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import Pairs, ranges

# What differs by less than this part is equal. Rounding differs by some 1e-14 on a lattice.
_EQUAL = 1e-10

# Odd numbers of 64 bits without a pattern, by which whole numbers are mixed.
_MIXER = np.uint64(0x9E3779B97F4A7C15)
_SHIFT = np.uint64(29)


def by_distinct_rows(
    pairs: Pairs,
    kernel_gradients: Array,
    volumes: Array,
    compute: Callable[[Pairs, Array, Array], Array],
) -> Array:
    """Weights (m, d) of all pairs, computed of one row among those that are equal.

    Args:
        pairs: the pairs.
        kernel_gradients: of all pairs, (m, d).
        volumes: of the body, (n,) [m^d].
        compute: from some rows, their kernel gradients and the volumes of the body to their
            weights, which depend on the offsets of neighbours and their volumes alone.
    """
    first, kinds = distinct_rows(pairs, volumes)
    if 2 * len(first) > pairs.row_count:
        return compute(pairs, kernel_gradients, volumes)
    own, part = pairs.chosen(first)
    found = compute(part, kernel_gradients[own], volumes)
    return found[ranges(part.starts[kinds], np.diff(pairs.starts))]


def distinct_rows(pairs: Pairs, volumes: Array) -> tuple[Indices, Indices]:
    """The first row of each kind (k,), and the kind of every row (n,).

    Rows are of one kind if the offsets of their neighbours and their `volumes` (n,) are equal.
    """
    fingerprints = _fingerprints(pairs, volumes)
    _, first, kinds = np.unique(fingerprints, return_index=True, return_inverse=True)
    return first, kinds


def _fingerprints(pairs: Pairs, volumes: Array) -> NDArray[np.uint64]:
    """A whole number for each row, (n,): equal for equal rows, and else for one pair in 2^64."""
    reach = _EQUAL * float(pairs.distances.max(initial=0.0)) or 1.0
    size = _EQUAL * float(volumes.max())
    mixed = np.arange(pairs.count, dtype=np.uint64)
    mixed -= pairs.spread(pairs.starts[:-1]).astype(np.uint64)
    _mix(mixed)
    mixed += _whole(volumes / size)[pairs.columns]
    _mix(mixed)
    for x in pairs.offsets.T:
        mixed += _whole(x / reach)
        _mix(mixed)
    return np.add.reduceat(mixed, pairs.starts[:-1])


def _whole(values: Array) -> NDArray[np.uint64]:
    return np.rint(values, out=values).astype(np.int64).view(np.uint64)


def _mix(numbers: NDArray[np.uint64]) -> None:
    """Mix the bits of each number, in place."""
    numbers *= _MIXER
    numbers ^= numbers >> _SHIFT
    numbers *= _MIXER
