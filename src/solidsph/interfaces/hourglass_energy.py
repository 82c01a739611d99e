"""Hourglass energy: of what the deformation gradients at both ends of a pair do not explain.

With H the gradient of the displacement u, X_ab = X_b - X_a and symmetric weights c_ab,

    e_ab = (H_a + H_b)/2 X_ab - (u_b - u_a),        energy = 1/4 sum over a, b of c_ab |e_ab|^2.

Its exact derivative needs no neighbours of neighbours: a pair force -c_ab e_ab, opposite at b, and
a stress S_a = 1/2 sum over b of c_ab e_ab (x) X_ab that acts through the transpose of the gradient.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from math import sqrt
from typing import final

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array, hstack, vstack
from scipy.sparse.linalg import LinearOperator, eigsh

from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.plan import Operations, SumMethod, vectors
from solidsph.maths.arrays import Array, Indices
from solidsph.model.neighbours import Pairs

# Of the largest eigenvalue of K over the masses, the square of a frequency.
_TOLERANCE = 0.02

# Up to this size a dense matrix is as cheap.
_SMALL = 40


@attrs.frozen(eq=False)
class HourglassPairs:
    """The pairs of one body whose error vector costs energy, each both ways."""

    body: Body
    starts: Indices  # (n + 1,) those of particle a stand at starts[a] : starts[a + 1]
    columns: NDArray[np.int32]  # (k,) b
    weights: Array  # (k,) c_ab > 0 [N/m]

    @classmethod
    def of(cls, body: Body, pairs: Pairs, weights: Array) -> HourglassPairs:
        """Of all `pairs` of a body, those with weights (m,) that are not zero."""
        kept = weights > 0.0
        counts = np.bincount(pairs.rows[kept], minlength=pairs.row_count)
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
        return cls(body, starts, pairs.columns[kept].astype(np.int32), weights[kept])

    def part(self, chosen: Indices) -> HourglassPairs:
        """That of the chosen particles (m,) alone, by the pairs both ends of which are chosen."""
        n = self.body.particles.count
        places = np.full(n, -1, dtype=np.intp)
        places[chosen] = np.arange(len(chosen))
        rows, columns = places[self.rows], places[self.columns]
        kept = (rows >= 0) & (columns >= 0)
        counts = np.bincount(rows[kept], minlength=len(chosen))
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
        body = part_of(self.body, chosen)
        return HourglassPairs(body, starts, columns[kept].astype(np.int32), self.weights[kept])

    @property
    def rows(self) -> Indices:
        """(k,) a."""
        return np.repeat(np.arange(self.body.particles.count), np.diff(self.starts))

    @property
    def offsets(self) -> Array:
        """(k, d) X_ab [m]."""
        X = self.body.particles.positions
        offsets: Array = X[self.columns] - X[self.rows]
        return offsets

    @cached_property
    def moments(self) -> Array:
        """Sum over b of c_ab |X_ab|^2, (n,) [J]."""
        return self._row_sums(self.weights * np.sum(self.offsets**2, axis=1))

    def squares(self, displacements: Array, gradients: Array) -> Array:
        """Sum over b of c_ab |e_ab|^2, (n,) [J], of displacements (n, d) with H (n, d, d)."""
        a, b = self.rows, self.columns
        mean = 0.5 * (gradients[a] + gradients[b])
        errors = np.einsum("mij,mj->mi", mean, self.offsets) - (displacements[b] - displacements[a])
        return self._row_sums(self.weights * np.sum(errors**2, axis=1))

    def _row_sums(self, values: Array) -> Array:
        count = self.body.particles.count
        return np.bincount(self.rows, weights=values, minlength=count).astype(np.float64)

    @property
    def bytes(self) -> int:
        """Memory of its arrays."""
        return self.starts.nbytes + self.columns.nbytes + self.weights.nbytes


class HourglassOperator(ABC):
    """The hourglass forces of one body, linear in its displacements: -K u, by components."""

    @property
    @abstractmethod
    def pairs(self) -> HourglassPairs:
        """What exerts them."""

    @property
    @abstractmethod
    def bytes(self) -> int:
        """Memory of the arrays kept."""

    @abstractmethod
    def operations(self, *, compiled: bool) -> Operations:
        """What an evaluation passes over, where whole steps are compiled or not."""

    @abstractmethod
    def forces(self, displacements: Array) -> Array:
        """Forces (n, d) [N] from displacements (n, d) [m]."""

    @abstractmethod
    def part(self, chosen: Indices) -> HourglassOperator:
        """Those of the chosen particles (m,) alone, numbered in their order.

        Right for those that stand deep enough among the chosen: the gradients of a particle's
        partners, and of the partners of its neighbours, need all of their own neighbours.
        """

    @cached_property
    def highest_frequency(self) -> float:
        """At most by 1 % above the largest angular frequency of these forces alone [rad/s].

        By Lanczos' iteration. A bound from sums of weights alone would be up to three times the
        frequency, since gradients lean on small differences of large weights.
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
        # The residual of the vector found bounds the error of its value by the tolerance.
        return sqrt(max(0.0, float(squares.max())) * (1.0 + _TOLERANCE))


@final
@attrs.frozen(eq=False)
class HourglassProducts(HourglassOperator):
    """As products of sparse matrices, K = J^T Z J: for bodies of few particles."""

    pairs: HourglassPairs
    jet: csr_array  # J, ((1 + d) n, n): u, then its derivative along each axis
    pull: csr_array  # Z, ((1 + d) n, (1 + d) n), symmetric: minus forces and stresses of a jet

    @classmethod
    def of(cls, pairs: HourglassPairs) -> HourglassProducts:
        """The operator of these pairs."""
        return cls(pairs, _jet(pairs.body), _pull(pairs))

    @property
    def bytes(self) -> int:
        own = [m.data.nbytes + m.indices.nbytes + m.indptr.nbytes for m in (self.jet, self.pull)]
        return sum(own) + self.pairs.bytes

    def operations(self, *, compiled: bool) -> Operations:
        n, d = self.pairs.body.particles.positions.shape
        # J stands twice, d times with the gradient's pairs; Z is of jets. The compiled loop makes
        # sweeps of it: H, near pairs, and the stress in return.
        way = SumMethod.HOURGLASS_SWEEPS if compiled else SumMethod.HOURGLASS_PRODUCTS
        near = len(self.pairs.columns) if compiled else self.pull.nnz // (1 + d)
        pairs = 2 * ((self.jet.nnz - n) // d) + near
        return Operations(way, pairs, n, self.bytes + vectors(n, d), self.bytes)

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
        """K (n, n) [N/m], with neighbours of neighbours of neighbours: in 3D, large."""
        return csr_array(self.jet.T @ (self.pull @ self.jet))


def _jet(body: Body) -> csr_array:
    """J, ((1 + d) n, n): from a field to itself and its derivatives along each axis."""
    pairs, particles = body.pairs(), body.particles
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    weights = body.formulation.gradient.weights(pairs, kernel_gradients, particles.cells)
    along = [pairs.matrix(weights[:, axis]) for axis in range(weights.shape[1])]
    return csr_array(vstack([eye_array(pairs.row_count, format="csr"), *along], format="csr"))


def _pull(pairs: HourglassPairs) -> csr_array:
    """Z, ((1 + d) n, (1 + d) n) [N/m, N, N m]: the energy of jets q is q Z q / 2."""
    once = np.flatnonzero(pairs.rows < pairs.columns)  # e_ba = -e_ab
    a, b, X = pairs.rows[once], pairs.columns[once], pairs.offsets[once]
    count, n = len(once), pairs.body.particles.count
    take_a, take_b = (
        csr_array((np.ones(count), (np.arange(count), end)), shape=(count, n)) for end in (a, b)
    )
    both = take_a + take_b
    halves = [diags_array(0.5 * X[:, axis]) @ both for axis in range(X.shape[1])]
    errors = csr_array(hstack([take_a - take_b, *halves], format="csr"))
    return csr_array(errors.T @ diags_array(pairs.weights[once]) @ errors)
