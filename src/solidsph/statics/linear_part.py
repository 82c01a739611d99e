"""The matrix of an affine map that is only known by what it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import csr_array

from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array, Indices

# Terms this far below the largest are rounding.
_NEGLIGIBLE = 1e-14

# How well the matrix must repeat the map on values that it was not read from.
_AGREEMENT = 1e-9


def linear_part(change: Callable[[Array], Array], size: int, labels: Sequence[str]) -> csr_array:
    """Matrix (m, size) of the affine map `change` from (size,) to (m,), where few columns matter.

    Ranges of columns are tried with random numbers and halved until each that answers stands
    alone, so that the cost is some probes for each column that is not zero. A map ignores a
    column if its result does not change by a bit.

    Raises:
        SolidsphError: the map is not affine; it belongs to the conditions named by `labels`.
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
        answer = change(probe) - at_rest
        answering = np.flatnonzero(answer)
        if not len(answering):
            continue
        if stop - start > 1:
            middle = (start + stop) // 2
            ranges += [(start, middle), (middle, stop)]
            continue
        rows.append(answering)
        columns.append(np.full(len(answering), start, dtype=np.intp))
        weights.append(answer[answering] / values[start])
    shape = (len(at_rest), size)
    if not rows:
        return csr_array(shape)
    weight = np.concatenate(weights)
    kept = np.abs(weight) > _NEGLIGIBLE * np.abs(weight).max()
    places = (np.concatenate(rows)[kept], np.concatenate(columns)[kept])
    matrix = csr_array((weight[kept], places), shape=shape)
    other = random.uniform(-1.0, 1.0, size)
    answer = change(other) - at_rest
    if np.abs(matrix @ other - answer).max() > _AGREEMENT * np.abs(answer).max():
        raise SolidsphError(
            f"statics needs what follows the free motion to follow it linearly; one of "
            f"{', '.join(repr(label) for label in labels)} does not: leave it out, or run in time"
        )
    return matrix
