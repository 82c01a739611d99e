"""Freedoms: which displacements are free, and how all others follow them."""

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
    """u = E q + c(t) with q the free displacements, and the force on q: f = R f_all.

    Components stand particle by particle, that along i of particle p at p d + i.
    """

    free: Mask  # (n, d)
    expansion: csr_array  # E, (d n, k)
    reduction: csr_array  # R, (k, d n)
    adjoint: bool  # whether R is the transpose of E, so that K stays symmetric

    @property
    def count(self) -> int:
        """Number of free degrees of freedom k."""
        return int(self.expansion.shape[1])

    def reduced(self, matrix: csr_array) -> csr_array:
        """R A E, (k, k), from A (d n, d n)."""
        return csr_array(self.reduction @ matrix @ self.expansion)

    def expanded(self, values: Array) -> Array:
        """E q, (n, d), from q (k,)."""
        everywhere: Array = (self.expansion @ values).reshape(self.free.shape)
        return everywhere


def freedoms(dynamics: Dynamics) -> Freedoms:
    """The freedoms that the motions of a scene leave.

    Raises:
        SolidsphError: a motion follows the free ones in a way that is not linear.
    """
    free = np.repeat(~dynamics.particles.ghosts[:, None], dynamics.particles.dimension, axis=1)
    returning = np.zeros_like(free)
    for motion in dynamics.constraints:
        free &= ~motion.held
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
    # Only those that give forces back hand them to whom they follow.
    kept = csr_array(followed.multiply(returning.reshape(-1, 1)))
    return Freedoms(
        free=free,
        expansion=csr_array(selection + followed),
        reduction=csr_array((selection + kept).T),
        adjoint=kept.nnz == followed.nnz,
    )
