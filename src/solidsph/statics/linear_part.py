"""Sparse matrix of an affine map that can only be evaluated."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import csr_array

from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array, Indices

# Smaller entries, relative to the largest, are rounding.
_NEGLIGIBLE = 1e-14

# Relative tolerance of the matrix on values other than the probes.
_AGREEMENT = 1e-9


def linear_part(change: Callable[[Array], Array], size: int, labels: Sequence[str]) -> csr_array:
    """Matrix (m, size) of the affine map `change` from (size,) to (m,) with few nonzero columns.

    Ranges of columns are probed with random numbers and halved, so that the cost is a few probes
    per nonzero column. A column is zero if the result does not change by a bit.

    Raises:
        SolidsphError: the map, which belongs to the terms `labels`, is not affine.
    """
    random = np.random.default_rng(0)
    values = random.uniform(1.0, 2.0, size) * random.choice([-1.0, 1.0], size)
    at_rest = change(np.zeros(size))
    rows: list[Indices] = []
    columns: list[Indices] = []
    weights: list[Array] = []
    ranges = [(0, size)] if size else []
    while ranges:
        start, stop = ranges.pop()
        probe = np.zeros(size)
        probe[start:stop] = values[start:stop]
        response = change(probe) - at_rest
        affected = np.flatnonzero(response)
        if not len(affected):
            continue
        if stop - start > 1:
            middle = (start + stop) // 2
            ranges += [(start, middle), (middle, stop)]
            continue
        rows.append(affected)
        columns.append(np.full(len(affected), start, dtype=np.intp))
        weights.append(response[affected] / values[start])
    shape = (len(at_rest), size)
    if not rows:
        return csr_array(shape)
    weight = np.concatenate(weights)
    kept = np.abs(weight) > _NEGLIGIBLE * np.abs(weight).max()
    places = (np.concatenate(rows)[kept], np.concatenate(columns)[kept])
    matrix = csr_array((weight[kept], places), shape=shape)
    other = random.uniform(-1.0, 1.0, size)
    response = change(other) - at_rest
    if np.abs(matrix @ other - response).max() > _AGREEMENT * np.abs(response).max():
        raise SolidsphError(
            "statics: constraints must depend linearly on the free displacements, but one of "
            f"{', '.join(map(repr, labels))} does not; leave it out, or leave out [statics]"
        )
    return matrix
