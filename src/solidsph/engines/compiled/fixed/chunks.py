"""Neighbour pairs of some particles at a time, so that no list of all pairs has to exist."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs

_ROWS_AT_ONCE = 2048


def weighted_chunks(body: Body, wanted: Mask) -> Iterator[tuple[Pairs, Array]]:
    """Pairs of the particles `wanted` (n,), some rows at a time, with gradient weights (m, d).

    Rows and columns are numbered within the body; the weights of a row depend on that row alone.

    Raises:
        BuildError: the neighbours of a particle do not determine a gradient.
    """
    positions, cells = body.particles.positions, body.particles.cells
    tree = cKDTree(positions)
    for rows in _chunks(wanted):
        pairs = _pairs_of(tree, body, rows)
        kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
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


def _pairs_of(tree: cKDTree, body: Body, rows: slice) -> Pairs:
    positions, radius = body.particles.positions, body.smoothing.support_radius
    n, k = len(positions), rows.stop - rows.start
    found = cKDTree(positions[rows]).sparse_distance_matrix(tree, radius, output_type="ndarray")
    keys = np.sort(found["i"] * n + found["j"])
    own, columns = np.divmod(keys, n)
    if body.hidden is not None:
        seen = ~body.hidden.between(own + rows.start, columns)
        own, columns = own[seen], columns[seen]
    offsets = positions[columns] - positions[own + rows.start]
    return Pairs(
        starts=np.searchsorted(own, np.arange(k + 1)).astype(np.intp),
        rows=own + rows.start,
        columns=columns,
        offsets=offsets,
        distances=np.linalg.norm(offsets, axis=1),
    )
