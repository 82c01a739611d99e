"""Where the weights of `consistent` change."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Mask

# Sums that miss less than this part of the largest are right but for rounding.
_RIGHT = 1e-10

# [spacings] from a sum that misses to the nearest row that does not change. With 2 to 8 the stable
# step, the errors and the largest change are the same. In a row of particles there are not enough
# weights to change in a rim.
_WIDTH = {1: np.inf, 2: 3.0, 3: 3.0}


def wrong(missing: Array) -> Mask:
    """Where sums miss (n, ...) more than rounding, (n,)."""
    size = np.abs(missing).reshape(len(missing), -1).max(axis=1)
    return np.asarray(size > _RIGHT * size.max())


def freedom(missing: Array, positions: Array, spacings: Array) -> Array:
    """How freely the weights of each row change, (n,): 1 where sums miss something, 0 deep inside.

    Args:
        missing: what the sums lack, (n, ...).
        positions: of the particles, (n, d) [m].
        spacings: of the particles, (n,) [m].
    """
    away, _ = cKDTree(positions[wrong(missing)]).query(positions)
    part = away / (_WIDTH[positions.shape[1]] * spacings)
    # Its third derivative is small: the sums of changes that vary faster would miss in turn.
    return np.where(part < 1.0, np.cos(0.5 * np.pi * np.minimum(part, 1.0)) ** 4, 0.0)
