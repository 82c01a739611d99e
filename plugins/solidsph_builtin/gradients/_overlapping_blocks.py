"""Approximate solutions of the sums of `consistent` without their first moments.

Smooth multipliers hardly change any weight: those that vary over n particles cost n^-6 of what
alternating ones cost, and conjugate gradients alone take a thousand steps. Here each step solves
the system of every small block of particles, and of polynomials that vary from block to block: the
additive Schwarz method with two levels (Toselli & Widlund 2005, chapters 2 and 3).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.gradients._passes import Passes, Sums

# Particles of a block, at most, by dimension, and how far it overlaps others [spacings]. In a plate
# with a hole in space uniform stresses balance to 1e-7 after 60 steps; after 80 with 120 particles
# a block. Without the polynomials it takes 200 and 470. In the plane, where changes keep to a rim,
# 250 make long blocks: a ring of 95 000 particles has 5 % left after 160 steps, with 60 2 %.
_CORE = {1: 60, 2: 60, 3: 250}
_OVERLAP = 2.0

# Patches of the polynomials, at most: in a cube of 46 particles a side 80 steps leave 4e-6 with
# 400, 4e-4 with 200.
_PATCHES = 400

# Keeps matrices regular, relative to their largest entry: those of blocks, for inverses of single
# precision, and that of polynomials, of which those of the whole body cost nothing.
_REGULAR, _REGULAR_OF_POLYNOMIALS = 1e-6, 1e-10


@final
@attrs.frozen(eq=False)
class OverlappingBlocks:
    """A symmetric, positive approximation of the inverse of the system for l alone."""

    passes: Passes
    ends: Indices  # (b + 1,) where the particles of each block begin, and the end
    members: Indices  # (m,) the particles of all blocks
    inverses: NDArray[np.float32]  # of the blocks' matrices (m', m'), one after the other
    polynomials: csr_array  # (n, c), on patches of their own
    factors: tuple[Array, bool]  # of the matrix between the polynomials, (c, c)

    @classmethod
    def of(cls, sums: Sums, passes: Passes, reached: Indices, soft: Array) -> OverlappingBlocks:
        """Of the particles that a change of the weights reaches.

        Args:
            sums: what the passes read.
            passes: over the pairs.
            reached: these particles (r,).
            soft: added to the diagonal of the matrix, (n,).
        """
        X, overlap = sums.positions[reached], _OVERLAP * sums.length
        blocks = [reached[near] for near, _ in _overlapping(X, _CORE[X.shape[1]], overlap)]
        functions = _polynomials(sums, reached)
        return cls(
            passes,
            np.cumsum([0, *map(len, blocks)]),
            np.concatenate(blocks),
            np.concatenate([_inverse(sums, passes, block, soft).ravel() for block in blocks]),
            functions,
            cho_factor(_matrix_of(sums, passes, functions, soft)),
        )

    def solve(self, r: Array) -> Array:
        """What the approximate inverse makes of r (n, d)."""
        Z = self.polynomials
        z: Array = Z @ cho_solve(self.factors, Z.T @ r)
        self.passes.add_solutions(self.ends, self.members, self.inverses, r, z)
        return z


def _overlapping(X: Array, most: int, overlap: float) -> Iterator[tuple[Indices, Array]]:
    """Places among X (n, d) of blocks of at most so many particles and what is within the `overlap`
    [m], and weights that vanish there."""
    for core in _halved(X, np.arange(len(X)), most):
        low, high = X[core].min(axis=0) - overlap, X[core].max(axis=0) + overlap
        close = np.flatnonzero(((low < X) & (high > X)).all(axis=1))
        away = np.asarray(cKDTree(X[core]).query(X[close], distance_upper_bound=overlap)[0])
        near = away < overlap
        # Smooth, so that polynomials times the weight cost little.
        yield close[near], np.cos(0.5 * np.pi * away[near] / overlap) ** 4


def _halved(X: Array, chosen: Indices, most: int) -> Iterator[Indices]:
    """Parts of the `chosen` places among X (n, d), halved along their longest side until small."""
    if len(chosen) <= most:
        yield chosen
        return
    longest = int(np.ptp(X[chosen], axis=0).argmax())
    order = chosen[np.argsort(X[chosen, longest], kind="stable")]
    middle = len(order) // 2
    yield from _halved(X, order[:middle], most)
    yield from _halved(X, order[middle:], most)


def _inverse(sums: Sums, passes: Passes, block: Indices, soft: Array) -> NDArray[np.float32]:
    """Of the matrix of a block of particles."""
    places = np.full(len(sums.positions), -1)
    places[block] = np.arange(len(block))
    rows = passes.rows_beside(sums, places)
    matrix = np.zeros((len(block), len(block)))
    passes.add_block(sums, rows, places, matrix)
    own = np.einsum("ii->i", matrix)
    own += soft[block] + _REGULAR * own.max()
    upper, _ = dpotri(cho_factor(matrix)[0])
    return np.asarray(np.triu(upper) + np.triu(upper, 1).T, dtype=np.float32)


def _polynomials(sums: Sums, reached: Indices) -> csr_array:
    """Polynomials of the second degree on overlapping patches, (n, c); orthonormal on each."""
    X = sums.positions[reached] / sums.length
    most = max(_CORE[X.shape[1]], len(reached) // _PATCHES)
    patches = list(_overlapping(X, most, _OVERLAP))
    total = np.zeros(len(X))
    for near, part in patches:
        total[near] += part
    upper = np.triu_indices(X.shape[1])
    rows, columns, values = [], [], []
    count = 0
    for near, part in patches:
        Y = X[near] - X[near].mean(axis=0)
        f = np.hstack([np.ones((len(Y), 1)), Y, Y[:, upper[0]] * Y[:, upper[1]]])
        own = np.linalg.qr((part / total[near])[:, None] * f)[0]
        rows.append(np.repeat(reached[near], own.shape[1]))
        columns.append(np.tile(np.arange(count, count + own.shape[1]), len(own)))
        values.append(own.ravel())
        count += own.shape[1]
    entries = [np.concatenate(part) for part in (values, rows, columns)]
    return csr_array((entries[0], (entries[1], entries[2])), shape=(len(sums.positions), count))


def _matrix_of(sums: Sums, passes: Passes, functions: csr_array, soft: Array) -> Array:
    """The matrix of the system between functions of the particles (n, c), (c, c)."""
    count = functions.shape[1]
    matrix = np.zeros((count, count))
    parts = functions.indptr, functions.indices, functions.data
    passes.add_functions(sums, parts, matrix)
    matrix += (functions.T @ (functions * soft[:, None])).toarray()
    matrix += _REGULAR_OF_POLYNOMIALS * matrix.diagonal().max() * np.eye(count)
    return matrix
