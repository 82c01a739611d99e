"""Slabs: a body cut across its longest side."""

from __future__ import annotations

from math import ceil

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.particles import Particles

# A slab has several rows of particles, so that the search for moving slabs is cheap.
_LEAST_SPACINGS = 4.0


@attrs.frozen(eq=False)
class Slabs:
    """Slabs of all particles in the reference configuration."""

    of: Indices  # (n,) slab of each particle
    count: int
    width: float  # [m]
    order: Indices  # particles slab by slab, (n,)
    starts: Indices  # first of each slab in `order`, (count,)

    @classmethod
    def across(cls, particles: Particles, wanted: int) -> Slabs:
        """At most `wanted` slabs across the longest side."""
        X = particles.positions
        axis = int(np.argmax(np.ptp(X, axis=0)))
        x = X[:, axis] - X[:, axis].min()
        spacing = float(particles.spacings.max())
        length = float(x.max()) + spacing
        count = max(1, min(wanted, int(length / (_LEAST_SPACINGS * spacing))))
        of = np.minimum((x / length * count).astype(np.intp), count - 1)
        # Where the body has gaps, empty slabs are dropped.
        used, of = np.unique(of, return_inverse=True)
        order = np.argsort(of, kind="stable")
        starts = np.searchsorted(of[order], np.arange(len(used)))
        return cls(of, len(used), length / count, order, starts)

    def largest(self, squares: Array) -> Array:
        """Square root of the maximum of `squares` (n,) over each slab, (count,)."""
        return np.sqrt(np.maximum.reduceat(squares[self.order], self.starts))

    def marked(self, particles: Indices) -> Mask:
        """Slabs (count,) that contain some of the particles."""
        slabs = np.zeros(self.count, dtype=np.bool_)
        slabs[self.of[particles]] = True
        return slabs

    def widened(self, slabs: Mask, distance: float) -> Mask:
        """`slabs`, and all others within `distance` [m] of them."""
        widened = slabs.copy()
        for k in range(1, ceil(distance / self.width) + 1):
            widened[k:] |= slabs[:-k]
            widened[:-k] |= slabs[k:]
        return widened
