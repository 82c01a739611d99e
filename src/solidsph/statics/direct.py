"""DirectSolver: the tangent stiffness as a sparse matrix, factorised."""

from __future__ import annotations

from typing import final

import attrs
from scipy.sparse import csr_array

from solidsph.maths.arrays import Array
from solidsph.statics.factors import Factors, factorise
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.linearised import Linearised, LinearSolver
from solidsph.statics.tangent import Tangent


@final
@attrs.frozen(eq=False)
class DirectSolver(LinearSolver):
    """Assembles the tangent over neighbours of neighbours and factorises it.

    Exact, for any divergence and any constraint. In three dimensions its time grows faster than the
    square of the number of particles, and its memory nearly as fast.
    """

    tangent: Tangent  # by matrices
    freedoms: Freedoms
    symmetric: bool

    def linearised(self, displacements: Array, ahead: Array | None, time: float) -> Linearised:
        matrix = self.tangent.matrix(displacements, ahead, time)
        reduced = self.freedoms.reduced(matrix)
        factors = factorise(reduced, symmetric=self.symmetric)
        return _Factorised(matrix, self.freedoms, reduced.diagonal(), factors)


@final
@attrs.frozen(eq=False)
class _Factorised(Linearised):
    """The tangent of all displacements, and the factors of its reduced form."""

    matrix: csr_array  # (d n, d n)
    freedoms: Freedoms
    own_diagonal: Array
    factors: Factors

    @property
    def diagonal(self) -> Array:
        return self.own_diagonal

    def pull(self, motion: Array) -> Array:
        pull: Array = self.freedoms.reduction @ (self.matrix @ motion.ravel())
        return pull

    def solve(self, forces: Array, tolerance: float) -> Array:
        return self.factors.solve(forces)

    def roughly(self, forces: Array) -> Array:
        return self.factors.solve(forces)

    def positive(self) -> bool:
        return self.factors.positive
