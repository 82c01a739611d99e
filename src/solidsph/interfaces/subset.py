"""Subset: some of the particles, numbered anew."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.maths.arrays import Indices


@attrs.frozen(eq=False)
class Subset:
    """Some of all particles, in rising order."""

    particles: Indices  # (k,)
    places: Indices  # (n,) their new numbers, -1 of all others

    @classmethod
    def of(cls, particles: Indices, count: int) -> Subset:
        """These particles of `count`."""
        places = np.full(count, -1, dtype=np.intp)
        places[particles] = np.arange(len(particles))
        return cls(particles, places)

    def kept(self, particles: Indices) -> tuple[Indices, Indices]:
        """Which entries of `particles` (m,) are in the subset, (k,), and their new numbers (k,)."""
        kept = np.flatnonzero(self.places[particles] >= 0)
        return kept, self.places[particles[kept]]
