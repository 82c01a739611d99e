"""Relaxation of particles by repulsion, until their distances are even."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Mask

# Particles repel each other up to this distance, in spacings: those across the diagonal of a cell.
_REACH = 1.5

_STEPS = 100

# A step is this part of a spacing times the sum of the forces, and no longer than that part.
_STEP = 0.1

# Neighbours are searched anew after so many steps, during which none moves by more than a spacing.
_SEARCH = 5

# Keeps the force of two particles at one place finite.
_SOFT = 1e-3


def relaxed(
    positions: Array,
    free: Mask,
    spacing: float,
    steps: int = _STEPS,
    onto: Callable[[Array], Array] = lambda moved: moved,
) -> Array:
    """`positions` (n, d) after repulsion has moved those that are `free` (n,), (n, d) [m].

    The force of a neighbour at q reaches is (1 - q)^2 / q. In a lattice the forces cancel. After
    each step the free ones are put `onto` a surface that they must not leave.
    """
    X = positions.copy()
    if not free.any():
        return X
    reach = _REACH * spacing
    # Others only hold the free ones in place.
    near = cKDTree(X[free]).query(X)[0] < reach + 2.0 * _SEARCH * _STEP * spacing
    some = np.flatnonzero(near)
    x, moves = X[some].copy(), free[some]
    for step in range(steps):
        if step % _SEARCH == 0:
            pairs = cKDTree(x).query_pairs(
                reach + 2.0 * _SEARCH * _STEP * spacing, output_type="ndarray"
            )
            a, b = pairs[moves[pairs].any(axis=1)].T
        offsets = x[b] - x[a]
        q = np.linalg.norm(offsets, axis=1) / reach
        strength = np.maximum(1.0 - q, 0.0) ** 2 / (q + _SOFT)
        away = strength[:, None] * offsets / np.maximum(q, _SOFT)[:, None] / reach
        way = np.stack(
            [
                np.bincount(b, force, minlength=len(x)) - np.bincount(a, force, minlength=len(x))
                for force in away.T
            ],
            axis=1,
        )
        length = np.linalg.norm(way, axis=1, keepdims=True)
        # Without any pair these are integers.
        way = way * (_STEP * spacing / np.maximum(length, 1.0))
        x[moves] = onto(x[moves] + way[moves])
    X[some] = x
    return X
