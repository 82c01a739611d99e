"""DirectSolver: the tangent stiffness as a sparse matrix, factorised."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, eigsh

from solidsph.maths.arrays import Array
from solidsph.maths.band import LastLayout
from solidsph.statics.factors import Factors, SingularError, factorise
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.increment import Increment
from solidsph.statics.lead import Lead
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
    last: LastLayout = attrs.field(factory=LastLayout, init=False)

    def linearised(
        self, displacements: Array, lead: Lead | None, increment: Increment, support: float = 0.0
    ) -> Linearised:
        matrix = self.tangent.during(increment).matrix(displacements, lead)
        reduced = self.freedoms.reduced(matrix)
        added = support * np.abs(reduced.diagonal())
        if support:
            reduced = csr_array(reduced + diags_array(added, format="csr"))
        factors = factorise(reduced, symmetric=self.symmetric, last=self.last)
        return _Factorised(matrix, self.freedoms, reduced.diagonal(), added, factors)

    def lowest_modes(
        self, displacements: Array, masses: Array, shift: float, count: int
    ) -> tuple[Array, Array]:
        whole = self.freedoms.reduced(self.tangent.matrix(displacements))
        # A load that follows its surface may have no energy: its symmetric part alone has modes.
        K, M = csr_array(0.5 * (whole + whole.T)), diags_array(masses)
        factors = factorise(csr_array(K + shift * M), symmetric=True)
        if not factors.positive:
            raise SingularError(None)
        squares, vectors = eigsh(
            K,
            k=count,
            M=M,
            sigma=-shift,
            OPinv=LinearOperator(K.shape, matvec=factors.solve, dtype=np.float64),
            # A reproducible start vector without the symmetries of the body.
            v0=np.random.default_rng(0).standard_normal(len(masses)),
        )
        return squares, vectors


@final
@attrs.frozen(eq=False)
class _Factorised(Linearised):
    """The tangent of all displacements, and the factors of its reduced form."""

    matrix: csr_array  # (d n, d n)
    freedoms: Freedoms
    own_diagonal: Array
    added: Array  # (k,)
    factors: Factors

    @property
    def support(self) -> Array:
        return self.added

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
