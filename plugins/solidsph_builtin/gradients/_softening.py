"""How far the sums of `consistent` may miss what integration by parts asks for."""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Array, Mask

# How far the sums of surface particles may miss their area, relative to the change of the weights:
# sampled areas may disagree with the volumes, and then no weights are exact. It must be small: a
# multiplier that varies over n particles costs n^-6 of one that alternates, so that with 1e-6 the
# loads on a side of 48 particles had errors large enough to spoil the second order, and
# with 1e-9 a uniform pressure on a block was balanced to 1.4e-6 only.
_AT_SURFACE = 1e-11

# The same for the first moments of all sums. A part of them is beyond reach, and others cost more
# change than they are worth: with 1e-5 a beam clamped on an arc is off by 2 % with 6 across, with
# 1e-3 by 0.05 %.
_MOMENTS = 1e-3


def softening(diagonal: Array, surface: Mask, sizes: Array) -> Array:
    """What to add to the `diagonal` of the system, both (n, 1 + d): for l, then for the rows of L.

    Args:
        diagonal: of the system.
        surface: tells the particles on the surface, (n,).
        sizes: spacings, in units of the length that L is multiplied by, (n,).
    """
    d = diagonal.shape[1] - 1
    # As V^2 w grows with the spacing; the rows of L have an arm more on both sides.
    scales = np.column_stack([sizes ** (2 * d - 2), *d * [sizes ** (2 * d)]])
    # The sums that a change of the weights reaches.
    changed = (diagonal / scales)[diagonal[:, 0] > 0.0]
    soft = np.full(diagonal.shape, _MOMENTS * float(changed[:, 1:].mean()))
    soft[:, 0] = np.where(surface, _AT_SURFACE * float(np.median(changed[:, 0])), 0.0)
    return np.asarray(soft * scales)
