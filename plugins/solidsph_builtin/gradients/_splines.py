"""Solutions of the sums of `consistent` among splines.

Smooth multipliers hardly change any weight: those that vary over n particles cost n^-6 of what
alternating ones cost, and conjugate gradients alone take a thousand steps. Few functions are enough
for the smooth ones. They must have two continuous derivatives: what changes weights is the third.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import final

import attrs
import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_array, hstack

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.gradients._passes import Passes, Sums

# Knots are as far apart [spacings], or further where that would give more functions than these.
# In a cube of 46 particles a side 44 steps leave 1e-7 with 4, 58 leave 7e-7 with 6.
_APART, _MOST = 4.0, 4000
_WIDER = 1.2

# Where the spacing varies there are splines of half the knots' distance, and so on, where the mean
# spacing is less than this part of what would suit them.
_FINER, _SUITS = 0.5, 1.5

# Functions with less than this part of the largest norm, which reach only a corner of the body, are
# left out.
_LEAST = 1e-3

# Their matrix is made from so many rows a function: with 2 a ball of 5 400 particles takes as many
# steps as with 15, with 1 half as many again.
_ROWS = 3

# Keeps it regular, relative to its largest entry: some functions change no weight.
_REGULAR = 1e-12


@final
@attrs.frozen(eq=False)
class Splines:
    """Cubic B-splines over a body, and the system for l alone between them."""

    functions: csr_array  # (n, c)
    factors: tuple[Array, bool]  # of the matrix, (c, c)

    @classmethod
    def of(
        cls, sums: Sums, passes: Passes, reached: Indices, soft: Array, spacings: Array
    ) -> Splines:
        """At the particles that a change of the weights reaches.

        Args:
            sums: what the passes read.
            passes: over the pairs.
            reached: these particles (r,).
            soft: added to the diagonal of the matrix of the particles, (n,).
            spacings: of the particles, (n,) [m].
        """
        functions = _functions(sums.positions, spacings, reached)
        matrix = _matrix_of(sums, passes, functions, soft)
        return cls(functions, cho_factor(matrix, overwrite_a=True))

    def solution(self, r: Array) -> Array:
        """The one among splines for r (n, d), (n, d)."""
        amounts = cho_solve(self.factors, self.functions.T @ r, check_finite=False)
        z: Array = self.functions @ amounts
        return z


def _matrix_of(sums: Sums, passes: Passes, functions: csr_array, soft: Array) -> Array:
    """The matrix of the system between functions (n, c), (c, c), from some of the rows."""
    count = functions.shape[1]
    rows = np.flatnonzero(sums.shares > 0.0)
    every = max(1, len(rows) // (_ROWS * count))
    matrix = np.zeros((count, count))
    parts = functions.indptr, functions.indices, functions.data
    passes.add_functions(sums, rows[::every], parts, matrix)
    matrix *= every
    where = np.flatnonzero(soft)
    softened = functions[where]
    matrix += (softened.T @ (softened * soft[where, None])).toarray()
    own = np.einsum("ii->i", matrix)
    own += _REGULAR * own.max()
    return matrix


def _functions(X: Array, spacings: Array, reached: Indices) -> csr_array:
    """B-splines at the `reached` particles (r,) of X (n, d) [m], 0 at others, (n, c).

    Their knots are grids over the bounding box. The functions have the norm 1.

    Args:
        X: places of all particles.
        spacings: of all particles, (n,) [m].
        reached: the particles.
    """
    apart = _APART
    while True:
        functions = csr_array(hstack(list(_levels(X, spacings, reached, apart)), format="csr"))
        if functions.shape[1] <= _MOST:
            return functions
        apart *= _WIDER


def _levels(X: Array, spacings: Array, reached: Indices, apart: float) -> Iterator[csr_array]:
    """B-splines with knots `apart` [spacings], the coarsest first."""
    suited = float(spacings[reached].max())
    yield _with_knots(X, reached, apart * suited)
    while True:
        suited *= _FINER
        if not (spacings[reached] < _SUITS * suited).any():
            return
        finer = _with_knots(X, reached, apart * suited)
        mean = finer.power(2).T @ spacings
        yield finer[:, np.flatnonzero(mean < _SUITS * suited)]


def _with_knots(X: Array, reached: Indices, apart: float) -> csr_array:
    x = X[reached] - X[reached].min(axis=0)
    size = x.max(axis=0, initial=0.0)
    cells = np.maximum(np.rint(size / apart), 1.0)
    x = x / np.maximum(size / cells, np.finfo(float).tiny)
    cell = np.minimum(np.floor(x), cells - 1.0)
    t = x - cell
    along = np.array(
        [
            (1.0 - t) ** 3,
            3.0 * t**3 - 6.0 * t**2 + 4.0,
            1.0 + 3.0 * t + 3.0 * t**2 * (1.0 - t),
            t**3,
        ]
    )
    shape = cells.astype(np.intp) + 3
    d = x.shape[1]
    values, columns = [], []
    for steps in product(range(4), repeat=d):
        values.append(np.prod([along[steps[i], :, i] for i in range(d)], axis=0))
        places = (cell + np.array(steps)).astype(np.intp)
        columns.append(np.ravel_multi_index(tuple(places.T), tuple(shape)))
    flat = np.ravel(np.array(values), order="F"), np.ravel(np.array(columns), order="F")
    norms = np.sqrt(np.bincount(flat[1], flat[0] ** 2, minlength=int(np.prod(shape))))
    kept = norms > _LEAST * norms.max()
    number = np.cumsum(kept) - 1
    counts = np.zeros(len(X), dtype=np.intp)
    inside = kept[flat[1]]
    counts[reached] = np.add.reduceat(inside, np.arange(0, len(inside), 4**d))
    value = (flat[0] / np.maximum(norms, np.finfo(float).tiny)[flat[1]])[inside]
    starts = np.concatenate([[0], np.cumsum(counts)])
    entries = (value, number[flat[1][inside]].astype(np.int32), starts.astype(np.int32))
    return csr_array(entries, shape=(len(X), int(kept.sum())))
