"""How fast a field bends from particle to particle, by what their neighbours make of it."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, eye_array

from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array


@final
@attrs.frozen(eq=False)
class LocalError:
    """The error of second order of the fields of one body.

    A field that is linear among neighbours is reproduced by sums over them. What is left of it
    beside the linear function that fits it best there is, up to a constant, the square of the
    spacing times its second derivative.
    """

    left: csr_array  # (n, n) a field less its local linear fit
    mean: csr_array  # (n, n) over the neighbours

    @classmethod
    def of(cls, body: Body) -> LocalError:
        """That of the particles of a body, ghosts among them, which count for nobody."""
        particles = body.particles
        pairs, radii, X = body.pairs(), body.radii, particles.positions
        p, q, (n, d) = pairs.rows, pairs.columns, X.shape
        offsets = (X[q] - X[p]) / radii[p, None]
        weights = np.clip(1.0 - np.einsum("mi,mi->m", offsets, offsets), 0.0, 1.0) ** 2
        weights = weights * ~particles.ghosts[q]
        terms = np.column_stack([np.ones(len(p)), offsets])
        moments = np.empty((n, 1 + d, 1 + d))
        for i in range(1 + d):
            for j in range(1 + d):
                moments[:, i, j] = np.bincount(p, weights * terms[:, i] * terms[:, j], n)
        at_centre = np.linalg.pinv(moments, hermitian=True)[:, 0]
        fit = weights * np.einsum("mi,mi->m", at_centre[p], terms)
        total = np.bincount(p, weights, n)[p]
        mean = np.divide(weights, total, out=np.zeros(len(p)), where=total > 0.0)
        return cls(
            csr_array(eye_array(n, format="csr") - csr_array((fit, (p, q)), shape=(n, n))),
            csr_array((mean, (p, q)), shape=(n, n)),
        )

    def squares(self, field: Array) -> Array:
        """Mean square of what is left of a field (n, ...), all components together, (n,)."""
        left = self.left @ field.reshape(len(field), -1)
        found: Array = self.mean @ np.einsum("nk,nk->n", left, left)
        return found
