"""PairTable: interacting pairs of particles, row by row."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.interfaces.plan import array_bytes
from solidsph.interfaces.subset import Subset
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import ranges, row_starts


@attrs.frozen(eq=False)
class PairTable:
    """Pairs of particles, each in both directions, with k numbers per pair."""

    starts: Indices  # (n + 1,) the pairs of particle p are starts[p] : starts[p + 1]
    columns: NDArray[np.int32]  # (m,) q
    values: Array  # (m, k) the same for (p, q) and (q, p)

    @classmethod
    def of(cls, rows: Indices, columns: Indices, values: Array, count: int) -> PairTable:
        """The table of pairs (m,) of `count` particles, in any order but in both directions."""
        order = np.lexsort((columns, rows))
        starts = row_starts(np.bincount(rows, minlength=count))
        return cls(starts, columns[order].astype(np.int32), values[order])

    @property
    def rows(self) -> Indices:
        """Particle p of every pair, (m,)."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    @property
    def bytes(self) -> int:
        """Memory of its arrays [bytes]."""
        return array_bytes([self.starts, self.columns, self.values])

    def part(self, subset: Subset) -> PairTable:
        """The pairs with both ends in a subset, renumbered."""
        sizes = np.diff(self.starts)[subset.particles]
        taken = ranges(self.starts[subset.particles], sizes)
        columns = subset.places[self.columns[taken]]
        inside = columns >= 0
        rows = np.repeat(np.arange(len(subset.particles)), sizes)[inside]
        counts = np.bincount(rows, minlength=len(subset.particles))
        return PairTable(
            row_starts(counts), columns[inside].astype(np.int32), self.values[taken[inside]]
        )
