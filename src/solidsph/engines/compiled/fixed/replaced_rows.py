"""Rows of all particles, of which some are replaced."""

from __future__ import annotations

import numpy as np

from solidsph.engines.compiled.fixed.rows import ROWS, RUN, Rows, stretches
from solidsph.interfaces.row_weights import RowWeights
from solidsph.maths.arrays import Indices, Mask
from solidsph.model.neighbours import ranges


def replaced_rows(rows: Rows, changed: RowWeights, count: int) -> Rows:
    """The rows of `count` particles, with the changed ones in their place.

    The others share stencils and members with `rows`, so that only a list of blocks is made anew.
    """
    stay = np.ones(count, dtype=np.bool_)
    stay[changed.particles] = False
    run = rows.blocks[:, 2] >= 0
    first, sizes, where = rows.blocks[~run].T
    particles, numbers = ranges(first, sizes), ranges(-1 - where, sizes)
    own = stay[particles]
    particles = np.concatenate([particles[own], changed.particles])
    begin = len(rows.row_weights) + changed.starts
    spans = np.concatenate(
        [rows.spans[numbers[own]], np.column_stack([begin[:-1], begin[1:]])]
    ).astype(np.intp)
    order = np.argsort(particles)
    particles = particles[order]
    at, lengths = stretches(particles, ROWS)
    single = np.column_stack([particles[at], lengths, -1 - at])
    blocks = np.concatenate([_without(rows.blocks[run], stay), single]).astype(np.intp)
    moved = changed.columns - np.repeat(changed.particles, changed.sizes)
    return rows._replace(
        blocks=np.ascontiguousarray(blocks[np.argsort(blocks[:, 0])]),
        spans=spans[order],
        row_offsets=np.concatenate([rows.row_offsets, moved.astype(np.int32)]),
        row_weights=np.concatenate(
            [rows.row_weights, changed.weights.astype(rows.row_weights.dtype)]
        ),
    )


def _without(runs: Indices, stay: Mask) -> Indices:
    """What the particles that stay (n,) leave of the blocks of runs (b, 3)."""
    first, sizes, stencils = runs.T
    particles = ranges(first, sizes)
    block = np.repeat(np.arange(len(runs)), sizes)
    left = stay[particles]
    particles, block = particles[left], block[left]
    at, lengths = stretches(particles + block, RUN)  # a new block is one further
    return np.column_stack([particles[at], lengths, stencils[block[at]]])
