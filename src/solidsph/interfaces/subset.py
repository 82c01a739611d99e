"""Subset: some of the particles, renumbered."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.maths.arrays import Indices


@attrs.frozen(eq=False)
class Subset:
    """Some of all particles, in ascending order."""

    particles: Indices  # (k,)
    places: Indices  # (n,) new number of every particle, -1 outside the subset

    @classmethod
    def of(cls, particles: Indices, count: int) -> Subset:
        """The subset of these particles (k,) among `count`."""
        places = np.full(count, -1, dtype=np.intp)
        places[particles] = np.arange(len(particles))
        return cls(particles, places)

    def kept(self, particles: Indices) -> tuple[Indices, Indices]:
        """Entries of `particles` (m,) that are in the subset, (k,), and their new numbers (k,)."""
        kept = np.flatnonzero(self.places[particles] >= 0)
        return kept, self.places[particles[kept]]
