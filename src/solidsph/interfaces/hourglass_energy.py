"""Hourglass energy: the energy of motions that the deformation gradients of a pair do not explain.

With H the gradient of the displacement u, X_ab = X_b - X_a and symmetric weights c_ab,

    e_ab = (H_a + H_b)/2 X_ab - (u_b - u_a),        energy = 1/4 sum over a, b of c_ab |e_ab|^2.

Its exact derivative needs no neighbours of neighbours: a pair force -c_ab e_ab, opposite at b, and
a stress S_a = 1/2 sum over b of c_ab e_ab (x) X_ab that acts through the transpose of the gradient.
The error vector e_ab is that of Ganzenmueller (2015).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from math import sqrt
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, hstack, vstack
from scipy.sparse.linalg import LinearOperator, eigsh

from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.pair_table import PairTable
from solidsph.interfaces.plan import Operations, SumMethod, array_bytes, vectors
from solidsph.interfaces.subset import Subset
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import Pairs

# Relative tolerance of the largest eigenvalue of K over the masses, the square of a frequency.
_TOLERANCE = 0.02

# Largest number of unknowns for which a dense matrix is as cheap.
_SMALL = 40


@attrs.frozen(eq=False)
class HourglassPairs:
    """Pairs of one body whose error vector costs energy."""

    body: Body
    table: PairTable  # with c_ab > 0 [N/m], (k, 1)

    @classmethod
    def of(cls, body: Body, pairs: Pairs, weights: Array) -> HourglassPairs:
        """The `pairs` of a body whose weights (m,) are not zero."""
        kept = weights > 0.0
        rows, columns, values = pairs.rows[kept], pairs.columns[kept], weights[kept, None]
        return cls(body, PairTable.of(rows, columns, values, pairs.row_count))

    def part(self, chosen: Indices) -> HourglassPairs:
        """The pairs with both ends among the chosen particles (m,), renumbered in order."""
        subset = Subset.of(chosen, self.body.particles.count)
        return HourglassPairs(part_of(self.body, chosen), self.table.part(subset))

    @property
    def weights(self) -> Array:
        """c_ab, (k,) [N/m]."""
        weights: Array = self.table.values[:, 0]
        return weights

    @property
    def offsets(self) -> Array:
        """X_ab, (k, d) [m]."""
        X = self.body.particles.positions
        offsets: Array = X[self.table.columns] - X[self.table.rows]
        return offsets

    @cached_property
    def moments(self) -> Array:
        """Sum over b of c_ab |X_ab|^2, (n,) [J]."""
        return self._row_sums(self.weights * np.sum(self.offsets**2, axis=1))

    def squares(self, displacements: Array, gradients: Array) -> Array:
        """Sum over b of c_ab |e_ab|^2, (n,) [J], for displacements (n, d) with H (n, d, d)."""
        a, b = self.table.rows, self.table.columns
        mean = 0.5 * (gradients[a] + gradients[b])
        errors = np.einsum("mij,mj->mi", mean, self.offsets) - (displacements[b] - displacements[a])
        return self._row_sums(self.weights * np.sum(errors**2, axis=1))

    def _row_sums(self, values: Array) -> Array:
        count = self.body.particles.count
        return np.bincount(self.table.rows, weights=values, minlength=count).astype(np.float64)


class HourglassOperator(ABC):
    """Hourglass forces of one body, linear in its displacements: -K u in every component."""

    @property
    @abstractmethod
    def pairs(self) -> HourglassPairs:
        """Pairs that exert the forces."""

    @property
    @abstractmethod
    def bytes(self) -> int:
        """Memory of the arrays kept [bytes]."""

    @abstractmethod
    def operations(self, *, compiled: bool) -> Operations:
        """Operations of one evaluation, if whole steps are `compiled` or not."""

    @abstractmethod
    def forces(self, displacements: Array) -> Array:
        """Forces (n, d) [N] from displacements (n, d) [m]."""

    @abstractmethod
    def part(self, chosen: Indices) -> HourglassOperator:
        """The operator of the chosen particles (m,) alone, renumbered in order.

        Exact for a particle if the partners of its neighbours, and its own partners, have all their
        neighbours among the chosen.
        """

    @cached_property
    def highest_frequency(self) -> float:
        """Largest angular frequency of these forces alone, at most 1 % too high [rad/s].

        By Lanczos iteration. A bound from sums of weights would be up to three times the frequency,
        since gradients rely on small differences of large weights.
        """
        masses, d = self.pairs.body.masses, self.pairs.body.particles.dimension
        moving = np.flatnonzero(masses > 0.0)
        scaling = 1.0 / np.sqrt(masses[moving])[:, None]
        u = np.zeros((len(masses), d))

        def product(direction: Array) -> Array:
            u[moving] = scaling * direction.reshape(-1, d)
            forces: Array = scaling * self.forces(u)[moving]
            return -forces.ravel()

        size = d * len(moving)
        if size <= _SMALL:
            squares = np.linalg.eigvalsh(np.stack([product(row) for row in np.eye(size)]))
        else:
            squares = eigsh(
                LinearOperator((size, size), matvec=product, dtype=np.float64),
                k=1,
                which="LA",
                tol=_TOLERANCE,
                v0=np.random.default_rng(0).standard_normal(size),
                return_eigenvectors=False,
            )
        # The residual of the eigenvector bounds the error of the eigenvalue by the tolerance.
        return sqrt(max(0.0, float(squares.max())) * (1.0 + _TOLERANCE))


@final
@attrs.frozen(eq=False)
class HourglassProducts(HourglassOperator):
    """Hourglass forces as products of sparse matrices, K = J^T Z J, for bodies of few particles."""

    pairs: HourglassPairs
    jet: csr_array  # J, ((1 + d) n, n): u, then its derivative along each axis
    pull: csr_array  # Z, ((1 + d) n, (1 + d) n), symmetric: minus forces and stresses of a jet

    @classmethod
    def of(cls, pairs: HourglassPairs) -> HourglassProducts:
        """The operator of these pairs."""
        return cls(pairs, _jet(pairs.body), _pull(pairs))

    @property
    def bytes(self) -> int:
        matrices = (a for m in (self.jet, self.pull) for a in (m.data, m.indices, m.indptr))
        return array_bytes(matrices) + self.pairs.table.bytes

    def operations(self, *, compiled: bool) -> Operations:
        n, d = self.pairs.body.particles.positions.shape
        # J occurs twice, with the gradient's pairs d times; Z acts on jets. The compiled loop uses
        # sweeps instead: H, near pairs, and the stress in return.
        method = SumMethod.HOURGLASS_SWEEPS if compiled else SumMethod.HOURGLASS_PRODUCTS
        near = len(self.pairs.table.columns) if compiled else self.pull.nnz // (1 + d)
        pairs = 2 * ((self.jet.nnz - n) // d) + near
        return Operations(method, pairs, n, self.bytes + vectors(n, d), self.bytes)

    def forces(self, displacements: Array) -> Array:
        forces: Array = -(self.jet.T @ (self.pull @ (self.jet @ displacements)))
        return forces

    def part(self, chosen: Indices) -> HourglassOperator:
        pairs = self.pairs.part(chosen)
        n, d = self.pairs.body.particles.positions.shape
        jets = np.concatenate([k * n + chosen for k in range(1 + d)])
        jet = csr_array(csr_array(self.jet[jets])[:, chosen])
        return HourglassProducts(pairs, jet, _pull(pairs))

    def matrix(self) -> csr_array:
        """K (n, n) [N/m], which couples third neighbours and is large in 3D."""
        return csr_array(self.jet.T @ (self.pull @ self.jet))


def _jet(body: Body) -> csr_array:
    """J, ((1 + d) n, n): a field, then its derivative along each axis."""
    pairs, particles = body.pairs(), body.particles
    kernel_gradients = body.smoothing.gradients_of(pairs)
    weights = body.formulation.gradient.weights(pairs, kernel_gradients, particles.cells)
    along = [pairs.matrix(weights[:, axis]) for axis in range(weights.shape[1])]
    return csr_array(vstack([eye_array(pairs.row_count, format="csr"), *along], format="csr"))


def _pull(pairs: HourglassPairs) -> csr_array:
    """Z, ((1 + d) n, (1 + d) n) [N/m, N, N m]: the energy of jets q is q Z q / 2."""
    rows, columns = pairs.table.rows, pairs.table.columns
    once = np.flatnonzero(rows < columns)  # e_ba = -e_ab
    a, b, X = rows[once], columns[once], pairs.offsets[once]
    count, n = len(once), pairs.body.particles.count
    take_a, take_b = (
        csr_array((np.ones(count), (np.arange(count), end)), shape=(count, n)) for end in (a, b)
    )
    both = take_a + take_b
    halves = [diags_array(0.5 * X[:, axis]) @ both for axis in range(X.shape[1])]
    errors = csr_array(hstack([take_a - take_b, *halves], format="csr"))
    return csr_array(errors.T @ diags_array(pairs.weights[once]) @ errors)
