"""CoarseSpace: displacements that a coarse grid tells, and their stiffness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import attrs
import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron

from solidsph.interfaces.body import Body
from solidsph.maths.arrays import Array, Indices, Mask

# Sides of a cell, in spacings, unless the grid would have more nodes than can be factorised at
# once. Sides of 2 to 4 take about the same number of iterations.
_SIDE = 2.5
_MOST_NODES = {1: 10_000, 2: 10_000, 3: 1_500}

# Smaller diagonals of the stiffness, relative to the largest: no particle sees the function.
_UNSEEN = 1e-9

# Particles whose stiffness is formed at a time.
_CHUNK = 4096


@attrs.frozen(eq=False)
class CoarseSpace:
    """Functions that are multilinear in the cells of a grid, times signs of the particles.

    With signs that alternate along the rows of a lattice they are those fast displacements which
    gradients of symmetric neighbourhoods see as little as smooth ones.
    """

    signs: Array  # (s, n) of each pattern
    interpolation: csr_array  # (n, m) from values at the nodes
    kept: Mask  # (m d,) values at nodes that move free displacements only
    unknowns: Indices  # (c, 2^d d) values at the nodes of each cell
    order: Indices  # (n,) particles, cell by cell
    starts: Indices  # (c,) where each cell begins in it
    gradients: Sequence[Array]  # (n, 2^d, d) of each pattern's functions, in that order [1/m]

    @classmethod
    def of(
        cls,
        bodies: Sequence[Body],
        free: Mask,
        signs: Array,
        gradients_of: Callable[[Array], Array],
    ) -> CoarseSpace:
        """The space of a scene, with a grid for each body.

        What the sums make of a function at a particle is taken from its value and its slope there:
        exact for linear functions, and near enough for a preconditioner.

        Args:
            bodies: which together have all particles.
            free: the free displacements, (n, d).
            signs: of the particles in each pattern, (s, n).
            gradients_of: `InternalForces.gradients`, (n, d) to (n, d, d).
        """
        n, d = free.shape
        grids = [_Grid.over(body, n) for body in bodies]
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
        unknowns = (nodes[:, :, None] * d + np.arange(d)).reshape(n, -1)
        return cls(
            signs=signs,
            interpolation=interpolation,
            kept=(interpolation.T @ (~free).astype(np.float64)).ravel() == 0.0,
            unknowns=unknowns[order[starts]],
            order=order,
            starts=starts,
            gradients=[_seen(own, values, slopes, places, gradients_of)[order] for own in signs],
        )

    def restricted(self, forces: Array) -> Sequence[Array]:
        """Forces (n, d) [N] on the functions kept of each pattern."""
        n, d = forces.shape
        all_patterns = (self.signs.T[:, :, None] * forces[:, None, :]).reshape(n, -1)
        on_nodes = (self.interpolation.T @ all_patterns).reshape(-1, len(self.signs), d)
        return [on_nodes[:, k].ravel()[self.kept] for k in range(len(self.signs))]

    def extended(self, values: Sequence[Array]) -> Array:
        """Displacements (n, d) by the functions kept of each pattern."""
        n, m = self.interpolation.shape
        d = len(self.kept) // m
        at_nodes = np.zeros((m, len(self.signs), d))
        for k, own in enumerate(values):
            whole = np.zeros(m * d)
            whole[self.kept] = own
            at_nodes[:, k] = whole.reshape(m, d)
        all_patterns = (self.interpolation @ at_nodes.reshape(m, -1)).reshape(n, -1, d)
        extended: Array = np.einsum("kn,nki->ni", self.signs, all_patterns)
        return extended

    def matrix(self, pattern: int) -> csr_array:
        """Interpolation of one pattern, from the functions kept to displacements, (d n, k)."""
        d = len(self.kept) // self.interpolation.shape[1]
        signed = diags_array(self.signs[pattern]) @ self.interpolation
        whole = csr_array(kron(signed, eye_array(d), format="csr"))
        return csr_array(whole[:, np.flatnonzero(self.kept)])

    def stiffness(self, pattern: int, moduli: Array) -> csr_array:
        """Stiffness (k, k) [N/m] of the functions kept of one pattern.

        Args:
            pattern: which.
            moduli: dT_ik / dF_jl times the volume of each particle, (n, d d, d d) [N m].
        """
        gradients = self.gradients[pattern]
        n, corners, d = gradients.shape
        own = corners * d
        blocks = np.empty((len(self.starts), corners, d, d, corners))
        ends = np.append(self.starts, n)
        first = 0
        while first < len(self.starts):
            last = int(np.searchsorted(ends, ends[first] + _CHUNK, side="right")) - 1
            last = max(last, first + 1)
            B = gradients[ends[first] : ends[last]]
            A = moduli[self.order[ends[first] : ends[last]]].reshape(-1, d, d, d, d)
            # By k, i, j: sums over l of A_ikjl B_l, then over k with B_k.
            right = A.transpose(0, 2, 1, 3, 4).reshape(-1, d**3, d) @ B.transpose(0, 2, 1)
            each = B @ right.reshape(-1, d, d * d * corners)
            sums = np.add.reduceat(each, ends[first:last] - ends[first])
            blocks[first:last] = sums.reshape(-1, corners, d, d, corners)
            first = last
        blocks = blocks.transpose(0, 1, 2, 4, 3)
        rows = np.repeat(self.unknowns, own, axis=1)
        columns = np.tile(self.unknowns, (1, own))
        size = len(self.kept)
        whole = coo_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
        kept = np.flatnonzero(self.kept)
        matrix = csr_array(csr_array(whole)[kept][:, kept])
        diagonal = np.abs(matrix.diagonal())
        largest = diagonal.max(initial=0.0)
        return csr_array(
            matrix + diags_array(np.where(diagonal <= _UNSEEN * largest, largest, 0.0))
        )


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
    def over(cls, body: Body, total: int) -> _Grid:
        """The grid of a body, in a scene of `total` particles."""
        positions, spacing = body.particles.positions, float(body.particles.spacings.mean())
        d = positions.shape[1]
        side = spacing * max(_SIDE, (total / _MOST_NODES[d]) ** (1.0 / d))
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
