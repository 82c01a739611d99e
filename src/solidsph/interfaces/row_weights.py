"""RowWeights: the weights of a gradient at some particles of a body, row by row."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs, ranges, row_starts


@final
@attrs.frozen(eq=False)
class RowWeights:
    """Rows of some particles p: grad f at p = sum over the members q of f_q g_pq."""

    particles: Indices  # (k,) p, rising
    starts: Indices  # (k + 1,) the members of the k-th are starts[k] : starts[k + 1]
    columns: Indices  # (m,) q, rising in a row
    weights: Array  # (m, d) g_pq [1/m]

    @classmethod
    def of(cls, pairs: Pairs, weights: Array, kept: Mask) -> RowWeights:
        """The weights (m, d) of pairs, of those that are kept (m,); each particle's own is."""
        return cls(
            particles=pairs.rows[pairs.starts[:-1]],
            starts=row_starts(np.add.reduceat(kept, pairs.starts[:-1], dtype=np.intp)),
            columns=pairs.columns[kept],
            weights=weights[kept],
        )

    @classmethod
    def none(cls, dimension: int) -> RowWeights:
        """No rows."""
        empty = np.empty(0, dtype=np.intp)
        return cls(empty, np.zeros(1, dtype=np.intp), empty, np.empty((0, dimension)))

    @property
    def sizes(self) -> Indices:
        """Number of members of each row, (k,)."""
        return np.diff(self.starts)

    def gradients(self, field: Array) -> Array:
        """Gradients (k, d, d) of a vector field (n, d), H[i][k] = du_i / dx_k."""
        each = field[self.columns][:, :, None] * self.weights[:, None, :]
        return np.asarray(np.add.reduceat(each, self.starts[:-1], axis=0))

    def replaced_by(self, other: RowWeights) -> RowWeights:
        """These rows and those of `other`, which take the place of these."""
        stay = np.flatnonzero(~np.isin(self.particles, other.particles))
        kept = ranges(self.starts[stay], self.sizes[stay])
        particles = np.concatenate([self.particles[stay], other.particles])
        sizes = np.concatenate([self.sizes[stay], other.sizes])
        order = np.argsort(particles)
        # Where the rows in order stand, one after the other, in the members of both.
        members = ranges(row_starts(sizes)[order], sizes[order])
        return RowWeights(
            particles=particles[order],
            starts=row_starts(sizes[order]),
            columns=np.concatenate([self.columns[kept], other.columns])[members],
            weights=np.concatenate([self.weights[kept], other.weights])[members],
        )
