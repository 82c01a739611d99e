"""FilteredSolver: the tangent of bodies with a filter of the dilatation, factorised without it."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array

from solidsph.maths.arrays import Array
from solidsph.maths.band import LastLayout
from solidsph.statics.factors import Factors, SingularError, factorise
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.increment import Increment
from solidsph.statics.krylov import Krylov
from solidsph.statics.lead import Lead
from solidsph.statics.linearised import Linearised, LinearSolver
from solidsph.statics.lowest import lowest_modes
from solidsph.statics.tangent import Moduli, Tangent

# Iterations of one solution. The stiffness without the filter is up to lambda / (lambda - kappa)
# times as large: Cook's plate takes some 10 at Poisson's ratio 0.49, some 70 at 0.4999.
_MOST = 1000

# What a solution leaves of its forces: little, for Newton's method to converge as with factors.
_LEFT = 1e-4

# What the solution that looks for a falling motion leaves of its forces.
_LOOK = 1e-3


@final
@attrs.frozen(eq=False)
class FilteredSolver(LinearSolver):
    """Conjugate gradients, preconditioned by the factorised tangent without the filter.

    A filter couples particles three times as far apart as the rest of the tangent does, so its
    matrix would be nine times as large in the plane. For tangents that are symmetric.
    """

    tangent: Tangent  # by matrices
    freedoms: Freedoms
    last: LastLayout = attrs.field(factory=LastLayout, init=False)

    def linearised(
        self, displacements: Array, lead: Lead | None, increment: Increment, support: float = 0.0
    ) -> Linearised:
        tangent = self.tangent.during(increment)
        return self._linearised(
            tangent, tangent.moduli(displacements, lead), displacements, support
        )

    def lowest_modes(
        self, displacements: Array, masses: Array, shift: float, count: int
    ) -> tuple[Array, Array]:
        moduli = self.tangent.moduli(displacements)
        shifted = self._linearised(self.tangent, moduli, displacements, added=shift * masses)
        if not shifted.positive():
            raise SingularError(None)
        squares, modes = lowest_modes(shifted.product, shifted.roughly, masses, count)
        return squares - shift, modes

    def _linearised(
        self,
        tangent: Tangent,
        moduli: Moduli,
        displacements: Array,
        support: float = 0.0,
        added: Array | None = None,
    ) -> _Preconditioned:
        local = attrs.evolve(moduli, couplings=())
        of_loads = tangent.of_loads(displacements)
        reduced = self.freedoms.reduced(tangent.assembled(local, of_loads))
        support_of_each = support * np.abs(reduced.diagonal())
        if added is None:
            added = support_of_each
        if added.any():
            reduced = csr_array(reduced + diags_array(added, format="csr"))
        factors = factorise(reduced, symmetric=True, last=self.last)
        return _Preconditioned(
            self.freedoms, tangent, moduli, of_loads, reduced.diagonal(), added, factors
        )


@final
@attrs.frozen(eq=False)
class _Preconditioned(Linearised):
    """The tangent at one configuration, and the factors of what it is without the filter."""

    freedoms: Freedoms
    tangent: Tangent
    moduli: Moduli
    of_loads: csr_array | None
    own_diagonal: Array  # (k,)
    added: Array  # (k,)
    factors: Factors

    @property
    def support(self) -> Array:
        return self.added

    @property
    def diagonal(self) -> Array:
        return self.own_diagonal

    def pull(self, motion: Array) -> Array:
        resisted = self.tangent.product(self.moduli, motion).ravel()
        if self.of_loads is not None:
            resisted = resisted + self.of_loads @ motion.ravel()
        pull: Array = self.freedoms.reduction @ resisted
        return pull

    def solve(self, forces: Array, tolerance: float) -> Array:
        tolerance = min(tolerance, _LEFT)
        if not self.factors.positive:
            return self._krylov.of_any(forces, tolerance)
        return self._krylov.of_symmetric(forces, tolerance)

    def roughly(self, forces: Array) -> Array:
        return self.factors.solve(forces)

    def positive(self) -> bool:
        if not self.factors.positive:  # what the filter takes makes it no more so
            return False
        random = np.random.default_rng(0).standard_normal(len(self.own_diagonal))
        return not self._krylov.iterated(self.own_diagonal * random, _LOOK).falls

    def product(self, values: Array) -> Array:
        """Forces (k,) [N] that resist a motion (k,) [m]."""
        return self.pull(self.freedoms.expanded(values)) + self.added * values

    @property
    def _krylov(self) -> Krylov:
        return Krylov(self.product, self.factors.solve, _MOST)
