"""Compiled loops over the particles of a coarse grid, cell by cell."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from solidsph.engines.compiled.jit import njit


class Cells(NamedTuple):
    """What the loops read of a grid. Particles are in its order: cell by cell."""

    ends: Any  # (c + 1,) where the particles of each cell begin, and the end
    nodes: Any  # (c, 2^d) of each cell
    order: Any  # (n,) which particles they are
    values: Any  # (n, 2^d) of the multilinear functions
    signs: Any  # (n, s) of each pattern


class CoarseLoops(NamedTuple):
    """Compiled loops. Values at nodes are (m, s, d)."""

    # (cells, moduli (n, d d, d d) in the particles' own order, gradients (n, 2^d, d), places
    # (c, 2^d d, 2^d d) of the blocks' entries, sums): sums[places] += stiffness
    stiffness: Any
    # (cells, forces (n, d), on nodes): on nodes += what the functions take of them
    restrict: Any
    # (cells, values at nodes, displacements (n, d)): displacements += the functions' sum
    extend: Any


@cache
def coarse_loops(dimension: int, patterns: int) -> CoarseLoops:
    """The loops for one dimension and number of patterns of signs."""
    d, corners, own = dimension, 2**dimension, patterns * dimension

    # Innermost loops run over the corners or over the patterns' components, by vectors.
    @njit(error_model="numpy")
    def stiffness(cells, moduli, gradients, places, sums):
        block = np.empty((corners, d, d, corners))  # by a, i, j, b
        right = np.empty((d, corners))
        slopes = np.empty((d, corners))
        for c in range(len(cells.ends) - 1):
            block[:] = 0.0
            for m in range(cells.ends[c], cells.ends[c + 1]):
                p = cells.order[m]
                for b in range(corners):
                    for k in range(d):
                        slopes[k, b] = gradients[m, b, k]
                for i in range(d):
                    for j in range(d):
                        # By k, b: the sum over l of A_ikjl B_bl.
                        for k in range(d):
                            for b in range(corners):
                                right[k, b] = 0.0
                            for l in range(d):  # noqa: E741
                                A = moduli[p, i * d + k, j * d + l]
                                for b in range(corners):
                                    right[k, b] += A * slopes[l, b]
                        for a in range(corners):
                            for k in range(d):
                                B = slopes[k, a]
                                for b in range(corners):
                                    block[a, i, j, b] += B * right[k, b]
            for a in range(corners):
                for i in range(d):
                    for b in range(corners):
                        for j in range(d):
                            sums[places[c, a * d + i, b * d + j]] += block[a, i, j, b]

    @njit(error_model="numpy")
    def restrict(cells, forces, on_nodes):
        sums = np.empty((corners, own))
        signed = np.empty(own)
        for c in range(len(cells.ends) - 1):
            sums[:] = 0.0
            for m in range(cells.ends[c], cells.ends[c + 1]):
                p = cells.order[m]
                for s in range(patterns):
                    for i in range(d):
                        signed[s * d + i] = cells.signs[p, s] * forces[p, i]
                for a in range(corners):
                    value = cells.values[m, a]
                    for k in range(own):
                        sums[a, k] += value * signed[k]
            for a in range(corners):
                for s in range(patterns):
                    for i in range(d):
                        on_nodes[cells.nodes[c, a], s, i] += sums[a, s * d + i]

    @njit(error_model="numpy")
    def extend(cells, at_nodes, displacements):
        corner = np.empty((corners, own))
        total = np.empty(own)
        for c in range(len(cells.ends) - 1):
            for a in range(corners):
                for s in range(patterns):
                    for i in range(d):
                        corner[a, s * d + i] = at_nodes[cells.nodes[c, a], s, i]
            for m in range(cells.ends[c], cells.ends[c + 1]):
                p = cells.order[m]
                total[:] = 0.0
                for a in range(corners):
                    value = cells.values[m, a]
                    for k in range(own):
                        total[k] += value * corner[a, k]
                for s in range(patterns):
                    for i in range(d):
                        displacements[p, i] += cells.signs[p, s] * total[s * d + i]

    return CoarseLoops(stiffness, restrict, extend)
