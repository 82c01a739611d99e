"""Relaxation of particles by repulsion, until their distances are even."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.system.build_log import BUILD
from solidsph_builtin.discretisations._nearest import beside

# Particles repel each other up to this distance, in spacings: those across the diagonal of a cell.
REACH = 1.5

_STEPS = 100

# A step is this part of a spacing times the sum of the forces, and no longer than that part.
_STEP = 0.1

# Pairs are searched up to this part beyond the reach, and anew once two may have come closer by it.
_SLACK = 0.15

# Keeps the force of two particles at one place finite.
_SOFT = 1e-3

# From so many moving particles on, compiled loops are worth the time of loading the compiler.
_MANY = 5000


def relaxed(
    positions: Array,
    free: Mask,
    spacing_at: Callable[[Array], Array],
    steps: int = _STEPS,
    onto: Callable[[Array], Array] = lambda moved: moved,
) -> Array:
    """`positions` (n, d) after repulsion has moved those that are `free` (n,), (n, d) [m].

    In a lattice the forces cancel. After each step the free ones are put `onto` a surface that they
    must not leave.

    Args:
        positions: where they start [m].
        free: which of them move, (n,).
        spacing_at: the wanted distance at positions (m, d), (m,) [m].
        steps: how often they move.
        onto: from positions (m, d) to the allowed ones nearest to them, (m, d) [m].
    """
    X = positions.copy()
    if not free.any():
        return X
    widest = REACH * float(spacing_at(X).max())
    # Others only hold the free ones in place.
    some = np.flatnonzero(beside(X[free], X, 2.0 * widest))
    x, moves = X[some].copy(), free[some]
    sums, slack = _sums_by_arrays if moves.sum() < _MANY else _sums_by_loops, -1.0
    for step in range(steps):
        if slack < 0.0:
            BUILD.debug("spreading %d of %d, step %d of %d", moves.sum(), len(X), step, steps)
            sizes = spacing_at(x)
            slack = _SLACK * REACH * float(sizes.min())
            near = sums(x, sizes, moves)
        way = near(x)[moves]
        length = np.linalg.norm(way, axis=1, keepdims=True)
        before = x[moves]
        x[moves] = onto(before + way * (_STEP * sizes[moves, None] / np.maximum(length, 1.0)))
        slack -= 2.0 * float(np.linalg.norm(x[moves] - before, axis=1).max())
    X[some] = x
    return X


def pull(q: Any) -> Any:
    """Force between two particles over their distance, at a distance of q reaches [1/reach]."""
    return (1.0 - q) ** 2 / ((q + _SOFT) * np.maximum(q, _SOFT))


def _sums_by_arrays(x: Array, sizes: Array, moves: Mask) -> Callable[[Array], Array]:
    """The sum of forces on each particle that `moves` (n,), (n, d), at positions (n, d) that are
    near to `x` (n, d)."""
    pairs = _pairs(x, sizes)
    pairs = pairs[:, moves[pairs].any(axis=0)]
    reaches = 0.5 * REACH * sizes[pairs].sum(axis=0)

    def sums(x: Array) -> Array:
        offsets = x[pairs[1]] - x[pairs[0]]
        q = np.sqrt(np.einsum("mi,mi->m", offsets, offsets)) / reaches
        close = np.flatnonzero(q < 1.0)
        away = offsets[close] * (pull(q[close]) / reaches[close])[:, None]
        a, b = pairs[:, close]
        # Without any pair these are integers.
        return np.stack(
            [
                np.bincount(b, force, minlength=len(x)) - np.bincount(a, force, minlength=len(x))
                for force in away.T
            ],
            axis=1,
        ).astype(np.float64, copy=False)

    return sums


def _pairs(x: Array, sizes: Array) -> Indices:
    """Pairs that are near each other, or may come near, (2, m)."""
    widest = (1.0 + _SLACK) * REACH * float(sizes.max())
    pairs: Indices = cKDTree(x).query_pairs(widest, output_type="ndarray").T
    return pairs


def _sums_by_loops(x: Array, sizes: Array, moves: Mask) -> Callable[[Array], Array]:
    """The same by compiled loops."""
    from solidsph.engines.compiled.moving.search import candidates  # loads the compiler
    from solidsph_builtin.discretisations._relaxation_loop import add_forces

    starts, columns = candidates(x, (1.0 + _SLACK) * REACH * float(sizes.max()))

    def sums(x: Array) -> Array:
        way = np.zeros_like(x)
        add_forces(x, sizes, moves, starts, columns, way)
        return way

    return sums
