"""Neighbour pairs of some particles at a time, so that no list of all pairs has to exist."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs, listed_pairs
from solidsph.model.pair_search import PairSearch
from solidsph.system.build_log import BUILD

_ROWS_AT_ONCE = 2048


def weighted_chunks(body: Body, wanted: Mask) -> Iterator[tuple[Pairs, Array]]:
    """Pairs of the particles `wanted` (n,), some rows at a time, with gradient weights (m, d).

    Rows and columns are numbered within the body; the weights of a row depend on that row alone.

    Raises:
        BuildError: the neighbours of a particle do not determine a gradient.
    """
    positions, cells = body.particles.positions, body.particles.cells
    search = PairSearch.of(positions, body.radii)
    for rows in _chunks(wanted):
        BUILD.debug("%d of %d particles", rows.start, len(wanted))
        own, columns = search.near(np.arange(rows.start, rows.stop))
        count = rows.stop - rows.start
        pairs = listed_pairs(positions, own, columns, count, body.hidden, rows.start)
        kernel_gradients = body.smoothing.gradients_of(pairs)
        yield pairs, body.formulation.gradient.weights(pairs, kernel_gradients, cells)


def in_chunks(
    pairs: Pairs, weights: Array, rows: int = _ROWS_AT_ONCE
) -> Iterator[tuple[Pairs, Array]]:
    """A complete list of pairs and its weights (m, d), some rows at a time."""
    for first in range(0, pairs.row_count, rows):
        stop = min(first + rows, pairs.row_count)
        yield pairs.stretch(first, stop), weights[pairs.starts[first] : pairs.starts[stop]]


def _chunks(wanted: Mask) -> Iterator[slice]:
    """Stretches of consecutive wanted particles of limited length."""
    change = np.flatnonzero(np.diff(wanted, prepend=False, append=False))
    for begin, end in change.reshape(-1, 2).tolist():
        for first in range(begin, end, _ROWS_AT_ONCE):
            yield slice(first, min(first + _ROWS_AT_ONCE, end))
