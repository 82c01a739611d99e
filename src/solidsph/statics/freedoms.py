"""Freedoms: free displacements, and the linear dependence of all others on them."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import csr_array, eye_array

from solidsph.interfaces.terms import GhostConstraint
from solidsph.maths.arrays import Array, Mask
from solidsph.run.dynamics import Dynamics
from solidsph.statics.linear_part import linear_part


@attrs.frozen(eq=False)
class Freedoms:
    """Expansion u = E q + c(t) of the free displacements q, and reduction R f of forces.

    Component i of particle p has the index p d + i.
    """

    free: Mask  # (n, d)
    expansion: csr_array  # E, (d n, k)
    reduction: csr_array  # R, (k, d n)
    adjoint: bool  # R is the transpose of E, so that K stays symmetric

    @property
    def count(self) -> int:
        """Number k of free degrees of freedom."""
        return int(self.expansion.shape[1])

    def reduced(self, matrix: csr_array) -> csr_array:
        """R A E, (k, k), from A (d n, d n)."""
        if self.expansion.nnz == self.count:  # nothing follows
            kept = np.flatnonzero(self.free)
            return csr_array(matrix[kept][:, kept])
        return csr_array(self.reduction @ matrix @ self.expansion)

    def expanded(self, values: Array) -> Array:
        """E q, (n, d), from q (k,)."""
        expanded: Array = (self.expansion @ values).reshape(self.free.shape)
        return expanded


def freedoms(dynamics: Dynamics) -> Freedoms:
    """Freedoms that the constraints of a scene leave.

    Raises:
        SolidsphError: a constraint depends on the free displacements nonlinearly.
    """
    free = dynamics.free
    returning = np.zeros_like(free)
    for motion in dynamics.constraints:
        if isinstance(motion, GhostConstraint):
            returning |= motion.held
    selection = csr_array(eye_array(free.size, format="csr")[:, np.flatnonzero(free.ravel())])

    def following(values: Array) -> Array:
        displacements = np.zeros(free.shape)
        displacements[free] = values
        for motion in dynamics.constraints:
            motion.impose(0.0, 0, displacements)
        displacements[free] = 0.0
        return displacements.ravel()

    labels = [motion.label for motion in dynamics.constraints]
    followed = linear_part(following, int(free.sum()), labels)
    # Only constraints that return forces pass them on to the particles they follow.
    kept = csr_array(followed.multiply(returning.reshape(-1, 1)))
    return Freedoms(
        free=free,
        expansion=csr_array(selection + followed),
        reduction=csr_array((selection + kept).T),
        adjoint=kept.nnz == followed.nnz,
    )
