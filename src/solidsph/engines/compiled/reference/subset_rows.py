"""Rows of some of the particles alone, cut out of the rows of all."""

from __future__ import annotations

import numpy as np
from numba import njit

from solidsph.engines.compiled.reference.rows import ROWS, Rows, bands, starts_of
from solidsph.maths.arrays import Array, Indices


def part_of_rows(rows: Rows, chosen: Indices, count: int) -> Rows:
    """The rows of those of the chosen particles (k,) whose neighbours are all chosen.

    Particles are numbered anew, in their order. Runs of particles that follow each other go on to
    share their stencil, if its neighbours do too.

    Args:
        rows: of all `count` particles.
        chosen: in rising order.
        count: how many particles there are.
    """
    place = np.full(count, -1, dtype=np.intp)
    place[chosen] = np.arange(len(chosen))
    runs = _runs(rows.blocks, rows.members, rows.offsets, place)
    single = _complete(rows.blocks, rows.spans, rows.row_offsets, place)
    known: dict[tuple[int, bytes], int] = {}
    offsets: list[Indices] = []
    weights: list[Array] = []
    numbers = np.empty(len(runs), dtype=np.intp)
    for k, (p, _, stencil) in enumerate(runs):
        a, b = rows.members[stencil], rows.members[stencil + 1]
        own = place[p + rows.offsets[a:b]] - place[p]
        key = (int(stencil), own.tobytes())
        if key not in known:
            known[key] = len(offsets)
            offsets.append(own)
            weights.append(rows.stencil_weights[a:b])
        numbers[k] = known[key]
    members = starts_of(np.array([len(one) for one in offsets], dtype=np.intp))
    banded = [bands(one, start) for one, start in zip(offsets, members[:-1], strict=True)]
    particles, which = single.T
    spans = rows.spans[which]
    sizes = spans[:, 1] - spans[:, 0]
    ends = np.cumsum(sizes)
    taken = np.repeat(spans[:, 0] - (ends - sizes), sizes) + np.arange(sizes.sum())
    own_particles = np.repeat(particles, sizes)
    moved = place[own_particles + rows.row_offsets[taken]] - place[own_particles]
    blocks = np.concatenate(
        [
            np.column_stack([place[runs[:, 0]], runs[:, 1], numbers]),
            _blocks_of_rows(place[particles]),
        ]
    ).astype(np.intp)
    return Rows(
        blocks=np.ascontiguousarray(blocks[np.argsort(blocks[:, 0], kind="stable")]),
        members=members,
        stencils=starts_of(np.array([len(one) for one in banded], dtype=np.intp)),
        offsets=np.concatenate([rows.offsets[:0], *offsets]),
        stencil_weights=np.concatenate([rows.stencil_weights[:0], *weights]),
        bands=np.concatenate([rows.bands[:0], *banded]),
        spans=np.column_stack([ends - sizes, ends]).astype(np.intp),
        row_offsets=moved.astype(np.int32),
        row_weights=rows.row_weights[taken],
    )


def _blocks_of_rows(places: Indices) -> Indices:
    """(b, 3) of particles that have rows of their own, in rising order."""
    numbers = np.arange(len(places))
    # A block ends where the particles do not follow each other, or where it is full.
    fresh = np.diff(places, prepend=-2) != 1
    since = numbers - np.maximum.accumulate(np.where(fresh, numbers, 0))
    at = np.flatnonzero(since % ROWS == 0)
    return np.column_stack([places[at], np.diff([*at, len(places)]), -1 - at])


@njit
def _runs(blocks: Indices, members: Indices, offsets: Indices, place: Indices) -> Indices:
    """First particle, count and stencil of all that is left of runs, (k, 3)."""
    found = np.empty((len(place), 3), np.intp)
    count = 0
    for block in range(len(blocks)):
        first, size, stencil = blocks[block]
        if stencil < 0:
            continue
        a, b = members[stencil], members[stencil + 1]
        going = False
        for p in range(first, first + size):
            complete = place[p] >= 0
            same = going and place[p] == place[p - 1] + 1
            for m in range(a, b):
                if not complete:
                    break
                q = p + offsets[m]
                complete = place[q] >= 0
                same = same and place[q] == place[q - 1] + 1
            if complete and same:
                found[count - 1, 1] += 1
            elif complete:
                found[count, 0], found[count, 1], found[count, 2] = p, 1, stencil
                count += 1
            going = complete
    return found[:count].copy()


@njit
def _complete(blocks: Indices, spans: Indices, row_offsets: Indices, place: Indices) -> Indices:
    """Particle and row of those that have rows of their own and all neighbours, (k, 2)."""
    found = np.empty((len(place), 2), np.intp)
    count = 0
    for block in range(len(blocks)):
        first, size, where = blocks[block]
        if where >= 0:
            continue
        for slot in range(size):
            p, row = first + slot, -1 - where + slot
            complete = place[p] >= 0
            for m in range(spans[row, 0], spans[row, 1]):
                if not complete:
                    break
                complete = place[p + row_offsets[m]] >= 0
            if complete:
                found[count, 0], found[count, 1] = p, row
                count += 1
    return found[:count].copy()
