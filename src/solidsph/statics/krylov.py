"""Krylov: solutions of linear systems by products alone, and a preconditioner."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres, minres

from solidsph.maths.arrays import Array
from solidsph.maths.conjugate_gradients import Solution, conjugate_gradients
from solidsph.statics.linearised import UnsolvedError

# Iterations after which one for a tangent that is not symmetric, or not positive, begins anew.
_KEPT = 100


@attrs.frozen(eq=False)
class Krylov:
    """Iterations for a tangent stiffness of the free displacements."""

    product: Callable[[Array], Array]  # with motions (k,) [m]
    preconditioned: Callable[[Array], Array]  # about the motion by forces (k,) [N]
    most: int  # iterations of one solution

    def iterated(self, forces: Array, tolerance: float) -> Solution:
        """By conjugate gradients, which stop where a motion falls."""
        return conjugate_gradients(self.product, self.preconditioned, forces, tolerance, self.most)

    def of_symmetric(self, forces: Array, tolerance: float) -> Array:
        """Motion (k,) [m] under `forces` (k,) [N], of which a part `tolerance` may be left.

        The preconditioner must be symmetric and positive.

        Raises:
            UnsolvedError: the iterations do not suffice.
        """
        found = self.iterated(forces, tolerance)
        if found.falls:  # a tangent that lets some motions fall
            return self._by(minres, forces, tolerance, maxiter=self.most)
        if found.left > tolerance:
            raise UnsolvedError(found.left, self.most)
        return found.values

    def of_any(self, forces: Array, tolerance: float) -> Array:
        """The same for any tangent and any preconditioner.

        Raises:
            UnsolvedError: as above.
        """
        limits = {"restart": _KEPT, "maxiter": self.most // _KEPT}
        return self._by(gmres, forces, tolerance, **limits)

    def _by(
        self,
        method: Callable[..., tuple[Array, int]],
        forces: Array,
        tolerance: float,
        **limits: int,
    ) -> Array:
        shape = (len(forces), len(forces))
        try:
            solution, code = method(
                LinearOperator(shape, matvec=self.product, dtype=np.float64),
                forces,
                rtol=tolerance,
                M=LinearOperator(shape, matvec=self.preconditioned, dtype=np.float64),
                **limits,
            )
        except ValueError:  # rounding, of a tangent that is nearly singular
            raise UnsolvedError(1.0, self.most) from None
        if code != 0:
            left = np.linalg.norm(forces - self.product(solution)) / np.linalg.norm(forces)
            raise UnsolvedError(float(left), self.most)
        return solution
