"""Relaxation of particles by repulsion, until their distances are even."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask

# Particles repel each other up to this distance, in spacings: those across the diagonal of a cell.
_REACH = 1.5

_STEPS = 100

# A step is this part of a spacing times the sum of the forces, and no longer than that part.
_STEP = 0.1

# Neighbours are searched anew after so many steps, during which none moves by more than a spacing.
_SEARCH = 5
# Until two may have come closer by this, in spacings, only those within the reach and this count.
_SLACK = 0.2

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
            found, slack = pairs[moves[pairs[:, 0]] | moves[pairs[:, 1]]].T, -1.0
        if slack < 0.0:
            slack = _SLACK * spacing
            near_pairs, _ = _within(x, found, reach + slack)
        (a, b), offsets = _within(x, near_pairs, reach)
        q = np.linalg.norm(offsets, axis=1) / reach
        strength = (1.0 - q) ** 2 / (q + _SOFT)
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
        before = x[moves]
        x[moves] = onto(before + way[moves])
        slack -= 2.0 * float(np.linalg.norm(x[moves] - before, axis=1).max())
    X[some] = x
    return X


def _within(x: Array, pairs: Indices, distance: float) -> tuple[Indices, Array]:
    """The `pairs` (2, m) less than a `distance` apart, (2, k), and their offsets (k, d)."""
    offsets = x[pairs[1]] - x[pairs[0]]
    some = np.flatnonzero(np.einsum("mi,mi->m", offsets, offsets) < distance**2)
    return pairs[:, some], offsets[some]
