"""CoarseSpace: displacements that a coarse grid tells, and their stiffness."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, kron

from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.statics.coarse_loops import Cells, CoarseLoops, coarse_loops


@attrs.frozen
class Fineness:
    """How fine a grid is to be."""

    side: float  # of a cell, in spacings, unless there would be more nodes than the most
    most_nodes: Mapping[int, int]  # that can be factorised at once, by dimension


# Smaller diagonals of the stiffness, relative to the largest: no particle sees the function.
_UNSEEN = 1e-9


@attrs.frozen(eq=False)
class CoarseSpace:
    """Functions that are multilinear in the cells of a grid, times signs of the particles.

    With signs that alternate along the rows of a lattice they are those fast displacements which
    gradients of symmetric neighbourhoods see as little as smooth ones.
    """

    signs: Array  # (s, n) of each pattern
    interpolation: csr_array  # (n, m) from values at the nodes
    kept: Mask  # (m, d) values at nodes that move free displacements only
    cells: Cells
    gradients: Sequence[Array]  # (n, 2^d, d) of each pattern's functions, cell by cell [1/m]
    entries: csr_array  # (k, k) whose data are the places of the stiffness' entries
    places: Indices  # (c, 2^d d, 2^d d) of the entries of each cell; those not kept are the last

    @classmethod
    def of(
        cls,
        bodies: Sequence[Body],
        free: Mask,
        signs: Array,
        gradients_of: Callable[[Array], Array],
        fineness: Fineness,
    ) -> CoarseSpace:
        """The space of a scene, with a grid for each body.

        What the sums make of a function at a particle is taken from its value and its slope there:
        exact for linear functions, and near enough for a preconditioner.

        Args:
            bodies: which together have all particles.
            free: the free displacements, (n, d).
            signs: of the particles in each pattern, (s, n).
            gradients_of: `InternalForces.gradients`, (n, d) to (n, d, d).
            fineness: of the grids.
        """
        n = len(free)
        grids = [_Grid.over(body, n, fineness) for body in bodies]
        cells = _one_after_the_other([grid.cells for grid in grids])
        nodes = _one_after_the_other([grid.nodes for grid in grids])
        values = np.concatenate([grid.values for grid in grids])
        slopes = np.concatenate([grid.slopes for grid in grids])
        places = np.concatenate([grid.places for grid in grids])
        rows = np.repeat(np.arange(n), nodes.shape[1])
        size = int(nodes.max()) + 1
        interpolation = csr_array((values.ravel(), (rows, nodes.ravel())), shape=(n, size))
        order = np.argsort(cells, kind="stable")
        _, starts = np.unique(cells[order], return_index=True)
        kept = interpolation.T @ (~free).astype(np.float64) == 0.0
        of_cells = np.ascontiguousarray(nodes[order[starts]])
        entries, at = _entries(of_cells, kept)
        return cls(
            signs=signs,
            interpolation=interpolation,
            kept=kept,
            cells=Cells(
                ends=np.append(starts, n),
                nodes=of_cells,
                order=order,
                values=values[order],
                signs=np.ascontiguousarray(signs.T),
            ),
            gradients=[_seen(own, values, slopes, places, gradients_of)[order] for own in signs],
            entries=entries,
            places=at,
        )

    def restricted(self, forces: Array) -> Sequence[Array]:
        """Forces (n, d) [N] on the functions kept of each pattern."""
        m, d = self.kept.shape
        on_nodes = np.zeros((m, len(self.signs), d))
        self._loops.restrict(self.cells, forces, on_nodes)
        return [on_nodes[:, k][self.kept] for k in range(len(self.signs))]

    def extended(self, values: Sequence[Array]) -> Array:
        """Displacements (n, d) by the functions kept of each pattern."""
        m, d = self.kept.shape
        at_nodes = np.zeros((m, len(self.signs), d))
        for k, own in enumerate(values):
            at_nodes[:, k][self.kept] = own
        extended = np.zeros((len(self.cells.order), d))
        self._loops.extend(self.cells, at_nodes, extended)
        return extended

    def matrix(self, pattern: int) -> csr_array:
        """Interpolation of one pattern, from the functions kept to displacements, (d n, k)."""
        d = self.kept.shape[1]
        signed = diags_array(self.signs[pattern]) @ self.interpolation
        whole = csr_array(kron(signed, eye_array(d), format="csr"))
        return csr_array(whole[:, np.flatnonzero(self.kept)])

    def stiffness(self, pattern: int, moduli: Array) -> csr_array:
        """Stiffness (k, k) [N/m] of the functions kept of one pattern.

        Args:
            pattern: which.
            moduli: dT_ik / dF_jl times the volume of each particle, (n, d d, d d) [N m].
        """
        sums = np.zeros(self.entries.nnz + 1)
        self._loops.stiffness(self.cells, moduli, self.gradients[pattern], self.places, sums)
        matrix = self.entries.copy()
        matrix.data = sums[:-1]
        diagonal = np.abs(matrix.diagonal())
        largest = diagonal.max(initial=0.0)
        return csr_array(
            matrix + diags_array(np.where(diagonal <= _UNSEEN * largest, largest, 0.0))
        )

    @property
    def _loops(self) -> CoarseLoops:
        return coarse_loops(self.kept.shape[1], len(self.signs))


def _entries(nodes: Indices, kept: Mask) -> tuple[csr_array, Indices]:
    """`CoarseSpace.entries` and `places` for cells with these nodes (c, 2^d)."""
    size, count = kept.size, int(kept.sum())
    numbers = np.full(size, count)
    numbers[kept.ravel()] = np.arange(count)
    # Of the values at the nodes of each cell, (c, 2^d d).
    own = numbers.reshape(kept.shape)[nodes].reshape(len(nodes), -1)
    rows, columns = np.broadcast_arrays(own[:, :, None], own[:, None, :])
    inside = (rows < count) & (columns < count)
    found, which = np.unique(rows[inside] * count + columns[inside], return_inverse=True)
    places = np.full(inside.shape, len(found))
    places[inside] = which
    entries = csr_array(
        (np.arange(len(found), dtype=np.float64), (found // count, found % count)),
        shape=(count, count),
    )
    return entries, places


def _seen(
    signs: Array,
    values: Array,
    slopes: Array,
    places: Array,
    gradients_of: Callable[[Array], Array],
) -> Array:
    """Gradients (n, 2^d, d) that the sums see in functions times signs [1/m]."""
    alone = np.zeros_like(places)
    alone[:, 0] = signs
    sums = gradients_of(alone)[:, 0]
    moments = gradients_of(signs[:, None] * places)  # n, i, k
    moments -= places[:, :, None] * sums[:, None, :]
    seen: Array = values[:, :, None] * sums[:, None, :] + slopes @ moments
    return seen


@attrs.frozen(eq=False)
class _Grid:
    """Cells over one body, and what their functions are at its particles."""

    cells: Indices  # (n,)
    nodes: Indices  # (n, 2^d) of the cell of each particle
    values: Array  # (n, 2^d)
    slopes: Array  # (n, 2^d, d) [1/m]
    places: Array  # (n, d) positions in the grid [m]

    @classmethod
    def over(cls, body: Body, total: int, fineness: Fineness) -> _Grid:
        """The grid of a body, in a scene of `total` particles."""
        positions, spacing = body.particles.positions, float(body.particles.spacings.mean())
        d = positions.shape[1]
        least = (total / fineness.most_nodes[d]) ** (1.0 / d)
        side = spacing * max(fineness.side, least)
        lowest = positions.min(axis=0)
        extent = np.maximum(positions.max(axis=0) - lowest, spacing)
        count = np.maximum(1, np.floor(extent / side)).astype(np.intp)
        sides = extent / count
        places = positions - lowest
        cell = np.minimum(places / sides, count - 1).astype(np.intp)
        within = places / sides - cell
        nodes, values, slopes = [], [], []
        for corner in product((0, 1), repeat=d):
            shares = np.where(corner, within, 1.0 - within)
            rises = np.where(corner, 1.0, -1.0) / sides
            nodes.append(np.ravel_multi_index(tuple((cell + corner).T), tuple(count + 1)))
            values.append(shares.prod(axis=1))
            slopes.append(
                np.stack([rises[a] * np.delete(shares, a, 1).prod(axis=1) for a in range(d)], 1)
            )
        _, used = np.unique(np.stack(nodes, axis=1), return_inverse=True)
        return cls(
            cells=np.unique(np.ravel_multi_index(tuple(cell.T), tuple(count)), return_inverse=True)[
                1
            ],
            nodes=used.reshape(len(positions), -1),
            values=np.stack(values, axis=1),
            slopes=np.stack(slopes, axis=1),
            places=places,
        )


def _one_after_the_other(numbers: Sequence[Indices]) -> Indices:
    """Numbers of the bodies' own, each from 0 on, as numbers of the scene."""
    counts = np.cumsum([0, *(int(own.max()) + 1 for own in numbers)])
    return np.concatenate([own + first for own, first in zip(numbers, counts[:-1], strict=True)])
