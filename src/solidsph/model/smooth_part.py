"""SmoothPart: the part of a field that is smooth, by a filter that is its own adjoint."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations_with_replacement
from math import sqrt

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array

from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs

REACH = 2.6
"""Distance within which neighbours count [spacings]."""

# Of the weights (1 - (distance / reach)^2)^k.
_SHARPNESS = 1.5

# What 1 - fit takes of waves of two spacings squared: 1 inside a body, up to 1.25 in the plane and
# 1.5 in space beside surfaces. S leaves little of any if it is between.
_TAKEN = 1.06

# Added to the moments of neighbours, relative to their trace: some may not determine all terms.
_RIDGE = 1e-12

# Pairs treated at once: what there is of them then stays in the cache of a core.
_PAIRS_AT_ONCE = 15_000


@attrs.frozen(eq=False)
class SmoothPart:
    """S = 1 - R* R, with R f in proportion to what a field f differs by from the quadratic fitted
    around each particle.

    The adjoint R* is by volumes, so S is its own adjoint. Quadratic fields are kept, up to surfaces
    too; what alternates from particle to particle is not.
    """

    rows: csr_array  # (n, n): R
    volumes: Array  # (n,)

    @classmethod
    def of(cls, pairs: Pairs, spacings: Array, volumes: Array, kept: Mask) -> SmoothPart:
        """Of fields at particles, as their neighbours tell.

        Args:
            pairs: those within reach, self pairs included.
            spacings: of the particles, (n,) [m].
            volumes: of the particles, (n,).
            kept: particles at which fields have values, (n,); others neither count nor change.
        """
        rows = max(1, _PAIRS_AT_ONCE * pairs.row_count // pairs.count)
        values = [
            _fit(pairs.stretch(first, min(first + rows, pairs.row_count)), spacings, kept)
            for first in range(0, pairs.row_count, rows)
        ]
        rough = -np.concatenate(values)
        rough[pairs.self_pairs] += kept
        return cls(pairs.matrix(rough / sqrt(_TAKEN)), volumes)

    def change(self, field: Array) -> Array:
        """S f - f of a field (n,)."""
        return np.asarray(-(self.adjoint @ (self.rows @ field)))

    @cached_property
    def adjoint(self) -> csr_array:
        """R*, (n, n)."""
        weighed = self.rows.T @ diags_array(self.volumes)
        return csr_array(diags_array(1.0 / self.volumes) @ weighed)

    @cached_property
    def matrix(self) -> csr_array:
        """S - 1, (n, n)."""
        return csr_array(-(self.adjoint @ self.rows))


def _fit(pairs: Pairs, spacings: Array, kept: Mask) -> Array:
    """Weight (m,) of every neighbour in the value of the fit at the particles of some rows."""
    p, q = pairs.rows, pairs.columns
    x = pairs.offsets / spacings[p, None]
    squares = np.einsum("mi,mi->m", x, x) / REACH**2
    weights = np.maximum(1.0 - squares, 0.0) ** _SHARPNESS * (kept[p] & kept[q])
    along = [np.ones(len(x)), *x.T]
    terms = np.stack([a * b for a, b in combinations_with_replacement(along, 2)], axis=1)
    moments = pairs.row_sums(weights[:, None, None] * terms[:, :, None] * terms[:, None, :])
    own = np.trace(moments, axis1=1, axis2=2)
    ridge = np.where(own > 0.0, _RIDGE * own, 1.0)
    moments += ridge[:, None, None] * np.eye(terms.shape[1])
    at_particle = np.zeros((*moments.shape[:2], 1))
    at_particle[:, 0] = 1.0  # the other terms vanish there
    factors = np.linalg.solve(moments, at_particle)[:, :, 0]
    return np.asarray(weights * np.einsum("mk,mk->m", terms, pairs.spread(factors)))
