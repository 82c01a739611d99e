"""Momenta of a run, which nothing from outside may change."""

from __future__ import annotations

import numpy as np

from solidsph.maths.arrays import Array


def assert_momenta_stay(m: Array, x: Array, v: Array, *, least: float = 0.0) -> None:
    """Momentum and angular momentum of masses m (n,) at x (t, n, d) with velocities v (t, n, d).

    Changes of the second are measured against its largest value, or the `least`.
    """
    momentum = np.einsum("n,tni->ti", m, v)
    moments = np.einsum("n,tni,tnj->tij", m, x, v)
    moments -= moments.transpose(0, 2, 1)
    # Sums over some hundred particles and steps: rounding of each adds up to some 1e-14.
    assert np.abs(momentum - momentum[0]).max() <= 1e-12 * np.abs(momentum).max()
    assert np.abs(moments - moments[0]).max() <= 1e-12 * max(least, np.abs(moments).max())
