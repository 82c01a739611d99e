"""Rows of a subset of the particles, cut out of the rows of all."""

from __future__ import annotations

import numpy as np

from solidsph.engines.compiled.fixed.rows import ROWS, Rows, stretches
from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import ranges


def part_of_rows(rows: Rows, chosen: Indices, count: int) -> Rows:
    """The rows of the chosen particles (k,) whose neighbours are all chosen, renumbered in order.

    Runs continue to share their stencil where the neighbours are still consecutive.

    Args:
        rows: rows of all particles.
        chosen: particles in ascending order.
        count: number of particles.
    """
    place = np.full(count, -1, dtype=np.intp)
    place[chosen] = np.arange(len(chosen))
    runs = _runs(rows.blocks, rows.members, rows.offsets, place)
    single = _complete(rows.blocks, rows.spans, rows.row_offsets, place)
    known: dict[tuple[int, bytes], int] = {}
    stencils: list[tuple[Indices, Array]] = []
    numbers = np.empty(len(runs), dtype=np.intp)
    for k, (p, _, stencil) in enumerate(runs):
        a, b = rows.members[stencil], rows.members[stencil + 1]
        own = place[p + rows.offsets[a:b]] - place[p]
        key = (int(stencil), own.tobytes())
        if key not in known:
            known[key] = len(stencils)
            stencils.append((own, rows.stencil_weights[a:b]))
        numbers[k] = known[key]
    particles, which = single.T
    spans = rows.spans[which]
    sizes = spans[:, 1] - spans[:, 0]
    ends = np.cumsum(sizes)
    taken = ranges(spans[:, 0], sizes)
    own_particles = np.repeat(particles, sizes)
    moved = place[own_particles + rows.row_offsets[taken]] - place[own_particles]
    places = place[particles]
    at, count_at = stretches(places, ROWS)
    blocks = [
        np.column_stack([place[runs[:, 0]], runs[:, 1], numbers]),
        np.column_stack([places[at], count_at, -1 - at]),
    ]
    return Rows.of(
        blocks=np.concatenate(blocks).astype(np.intp),
        stencils=stencils,
        spans=np.column_stack([ends - sizes, ends]).astype(np.intp),
        row_offsets=moved.astype(np.int32),
        row_weights=rows.row_weights[taken],
    )


@njit
def _runs(blocks: Indices, members: Indices, offsets: Indices, place: Indices) -> Indices:
    """First particle, count and stencil of what remains of runs, (k, 3)."""
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
    """Particle and row of those with rows of their own and all neighbours chosen, (k, 2)."""
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
