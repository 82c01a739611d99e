"""Relaxation by repulsion of particles whose spacing varies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.pair_search import PairSearch
from solidsph.system.build_log import BUILD
from solidsph_builtin.discretisations._relaxation import REACH, pull

# A step, and the longest, in spacings, from the first to the last.
_FIRST, _LAST = 0.1, 0.02
# Neighbours are searched anew after so many steps, up to this part beyond the reach.
_SEARCH, _SLACK = 5, 0.3


def relaxed_by(
    positions: Array,
    free: Mask,
    spacing: Callable[[Array], Array],
    steps: int,
    onto: Callable[[Array], Array] = lambda moved: moved,
) -> Array:
    """`positions` (n, d) after repulsion has moved those that are `free` (n,), (n, d) [m].

    The force of a neighbour is that of `relaxed`, with the mean of both reaches. After each step
    the free ones are put `onto` a surface that they must not leave.
    """
    x = positions.copy()
    if not free.any():
        return x
    for step in range(steps):
        if step % _SEARCH == 0:
            BUILD.debug("spreading %d of %d, step %d of %d", free.sum(), len(x), step, steps)
            s = spacing(x)
            pairs = _near(x, free, (REACH + _SLACK) * s)
        a, b = pairs
        offsets = x[b] - x[a]
        reach = REACH * 0.5 * (s[a] + s[b])
        q = np.linalg.norm(offsets, axis=1) / reach
        strength = pull(np.minimum(q, 1.0)) / reach
        way = np.stack(
            [
                np.bincount(b, force, minlength=len(x)) - np.bincount(a, force, minlength=len(x))
                for force in (strength[:, None] * offsets).T
            ],
            axis=1,
        )[free]
        length = np.linalg.norm(way, axis=1, keepdims=True)
        share = _FIRST + (_LAST - _FIRST) * step / steps
        x[free] = onto(x[free] + way * (share * s[free, None] / np.maximum(length, 1.0)))
    return x


def _near(x: Array, free: Mask, reaches: Array) -> tuple[Indices, Indices]:
    """Pairs of which one is free, each once."""
    rows = np.flatnonzero(free)
    places, b = PairSearch.of(x, reaches).near(rows)
    a = rows[places]
    once = (a < b) | ~free[b]
    return a[once], b[once]
