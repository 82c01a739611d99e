"""Signs that alternate along the rows of a lattice: patterns that gradients do not see."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from solidsph.maths.arrays import Array

# Particles this near to a point of the lattice are on it, in spacings; and the part of them that
# must be for the lattice to be one.
_NEAR = 0.1
_MOST_OF_THEM = 0.5


def alternating_signs(positions: Array, spacing: float) -> Sequence[Array]:
    """The 2^d - 1 patterns of signs (n,) that alternate along one or more axes.

    The gradient of such a pattern is zero wherever the neighbours of a particle are symmetric. All
    signs are 0 if most particles are on no lattice along the axes: they have no such patterns.

    Args:
        positions: of one body, (n, d) [m].
        spacing: of its particles [m].
    """
    d = positions.shape[1]
    lowest = positions.min(axis=0)
    extent = positions.max(axis=0) - lowest
    # The rows of a box are as far apart as fits it.
    count = np.maximum(np.round(extent / spacing), 1.0)
    rows = (positions - lowest) / np.where(extent > 0.0, extent / count, spacing)
    off = np.abs(rows - np.round(rows)).max(axis=1)
    on_lattice = bool(np.mean(off < _NEAR) >= _MOST_OF_THEM)
    odd = np.round(rows) % 2.0
    patterns = [np.array(chosen) for chosen in product((0.0, 1.0), repeat=d) if any(chosen)]
    return [(1.0 - 2.0 * (odd @ chosen % 2.0)) * on_lattice for chosen in patterns]
