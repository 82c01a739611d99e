"""Slabs: a body cut across its longest side, and which of them move."""

from __future__ import annotations

from math import ceil

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles

# A slab holds several rows of particles, so that what is awake is worth the search for it.
_LEAST_SPACINGS = 4.0


@attrs.frozen(eq=False)
class Slabs:
    """The slab of every particle, by its place in the reference configuration."""

    of: Indices  # (n,) number of its slab
    count: int
    width: float  # [m]
    order: Indices  # particles slab by slab, (n,)
    starts: Indices  # where each slab begins among them, (count,)

    @classmethod
    def across(cls, particles: Particles, wanted: int) -> Slabs:
        """As many as wanted, or as fit, across the longest side."""
        X = particles.positions
        axis = int(np.argmax(np.ptp(X, axis=0)))
        x = X[:, axis] - X[:, axis].min()
        spacing = float(particles.spacings.max())
        length = float(x.max()) + spacing
        count = max(1, min(wanted, int(length / (_LEAST_SPACINGS * spacing))))
        of = np.minimum((x / length * count).astype(np.intp), count - 1)
        # None is empty: a slab is wider than the body is sparse.
        used, of = np.unique(of, return_inverse=True)
        order = np.argsort(of, kind="stable")
        starts = np.searchsorted(of[order], np.arange(len(used)))
        return cls(of, len(used), length / count, order, starts)

    def largest(self, squares: Array) -> Array:
        """Square root of the largest of each slab's `squares` (n,), (count,)."""
        return np.sqrt(np.maximum.reduceat(squares[self.order], self.starts))

    def marked(self, particles: Indices) -> Mask:
        """Slabs (count,) in which some of the particles are."""
        found = np.zeros(self.count, dtype=np.bool_)
        found[self.of[particles]] = True
        return found

    def widened(self, slabs: Mask, distance: float) -> Mask:
        """The same, and all slabs that come within a distance [m] of them."""
        found = slabs.copy()
        for k in range(1, ceil(distance / self.width) + 1):
            found[k:] |= slabs[:-k]
            found[:-k] |= slabs[k:]
        return found
