"""Solutions of the sums of `consistent` in overlapping blocks of particles.

With those of smooth functions they are the two levels of an additive Schwarz method (Toselli &
Widlund 2005, chapters 2 and 3).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import spotrf
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.gradients._passes import Passes, Sums

# Particles of a block, at most, and how far it overlaps others [spacings]. In a cube of 46
# particles a side 44 steps leave 1e-7 with 250, 47 with 100, 52 with 30; with none, 58 leave 0.002.
_CORE = 100
_OVERLAP = 2.0

# Keeps the matrices regular for factors of single precision, relative to their largest entry.
_REGULAR = 1e-5


@final
@attrs.frozen(eq=False)
class OverlappingBlocks:
    """The factors of the system for l alone in overlapping blocks of particles."""

    passes: Passes
    ends: Indices  # (b + 1,) where the particles of each block begin, and the end
    members: Indices  # (m,) the particles of all blocks
    factors: NDArray[np.float32]  # Cholesky's, of the blocks one after the other, row by row

    @classmethod
    def of(
        cls, sums: Sums, passes: Passes, reached: Indices, soft: Array, spacings: Array
    ) -> OverlappingBlocks:
        """Of the particles that a change of the weights reaches.

        Args:
            sums: what the passes read.
            passes: over the pairs.
            reached: these particles (r,).
            soft: added to the diagonal of the matrix, (n,).
            spacings: of the particles, (n,) [m].
        """
        blocks = list(_overlapping(sums.positions, reached, _OVERLAP * spacings))
        ends = np.cumsum([0, *map(len, blocks)])
        factors = _factors(sums, passes, blocks, soft)
        return cls(passes, ends, np.concatenate(blocks), factors)

    def add_solutions(self, r: Array, z: Array) -> None:
        """Add to z (n, d) the sum of all blocks' solutions for r (n, d)."""
        self.passes.add_solutions(self.ends, self.members, self.factors, r, z)


def _overlapping(X: Array, reached: Indices, overlaps: Array) -> Iterator[Indices]:
    """Blocks of at most so many of the `reached` particles (r,) of X (n, d) and what of them is
    within their `overlaps` (n,) [m]."""
    tree = cKDTree(X[reached])
    for core in _halved(X[reached], np.arange(len(reached))):
        own = reached[core]
        near = tree.query_ball_point(X[own], overlaps[own])
        yield reached[np.unique(np.concatenate([np.asarray(one, dtype=np.intp) for one in near]))]


def _halved(X: Array, chosen: Indices) -> Iterator[Indices]:
    """Parts of the `chosen` places among X (n, d), halved along their longest side until small."""
    if len(chosen) <= _CORE:
        yield chosen
        return
    longest = int(np.ptp(X[chosen], axis=0).argmax())
    order = chosen[np.argsort(X[chosen, longest], kind="stable")]
    middle = len(order) // 2
    yield from _halved(X, order[:middle])
    yield from _halved(X, order[middle:])


def _factors(sums: Sums, passes: Passes, blocks: list[Indices], soft: Array) -> NDArray[np.float32]:
    """Of the matrices of the blocks of particles: lower triangles, one after the other."""
    places = np.full(len(sums.positions), -1)
    ends = np.cumsum([0, *(len(block) * (len(block) + 1) // 2 for block in blocks)])
    found = np.empty(ends[-1], dtype=np.float32)
    for block, begin, end in zip(blocks, ends[:-1], ends[1:], strict=True):
        places[block] = np.arange(len(block))
        matrix = np.zeros((len(block), len(block)), dtype=np.float32)
        passes.add_block(sums, passes.rows_beside(sums, block), places, matrix)
        places[block] = -1
        own = np.einsum("ii->i", matrix)
        own += soft[block] + _REGULAR * own.max()
        diagonal = own.copy()
        # LAPACK reads by columns: the rows of the lower triangle are columns of the upper one.
        factor, failed = spotrf(matrix.T, lower=False, clean=False, overwrite_a=True)
        if failed:  # by rounding; its diagonal will do
            factor = np.diag(np.sqrt(diagonal))
        passes.pack(factor.T, found[begin:end])
    return found
