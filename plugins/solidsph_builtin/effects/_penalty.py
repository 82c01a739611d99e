"""The penalty on what remains of a neighbour's offset after both deformation gradients.

With H the gradient of the displacement u, X_ab = X_b - X_a and symmetric weights c_ab,

    e_ab = (H_a + H_b)/2 X_ab - (u_b - u_a),        energy = 1/4 sum over a, b of c_ab |e_ab|^2.

Its exact derivative needs no neighbours of neighbours: a pair force -c_ab e_ab, opposite at b, and
a stress S_a = 1/2 sum over b of c_ab e_ab (x) X_ab that acts through the transpose of the gradient.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, hstack, vstack

from solidsph.arrays import Array, Indices
from solidsph.body import Body
from solidsph.neighbours import Pairs, neighbour_pairs

# Pairs count where their weight, relative to that of particles one spacing apart, is above this. On
# lattices with a cover near 3 those are the 2, 8 or 26 around a particle, which hold 98 % of the
# sum of all weights.
_SMALLEST_WEIGHT = 0.02


@attrs.frozen(eq=False)
class NearPairs:
    """The pairs of one body that are penalised."""

    pairs: Pairs  # self pairs among them
    weights: Array  # (m,) c_ab [N/m], those of self pairs and ghosts zero

    def moments(self) -> Array:
        """Sum over b of c_ab |X_ab|^2, (n,) [J]."""
        moments: Array = self.pairs.row_sums(self.weights * self.pairs.distances**2)
        return moments

    def squares(self, displacements: Array, gradients: Array) -> Array:
        """Sum over b of c_ab |e_ab|^2, (n,) [J], of displacements (n, d) with H (n, d, d)."""
        a, b, X = self.pairs.rows, self.pairs.columns, self.pairs.offsets
        mean = 0.5 * (gradients[a] + gradients[b])
        errors = np.einsum("mij,mj->mi", mean, X) - (displacements[b] - displacements[a])
        squares: Array = self.pairs.row_sums(self.weights * np.sum(errors**2, axis=1))
        return squares


def near_pairs(body: Body, strength: float) -> NearPairs:
    """Pairs with c_ab = strength mu V_a V_b W(X_ab) / |X_ab|^2."""
    particles = body.particles
    pairs = neighbour_pairs(particles.positions, _reach(body))
    real = ~particles.ghosts
    apart = (pairs.distances > 0.0) & real[pairs.rows] & real[pairs.columns]
    weights = np.zeros(pairs.count)
    r, a, b = pairs.distances[apart], pairs.rows[apart], pairs.columns[apart]
    _, mu = body.material.lame_parameters
    V = particles.volumes
    weights[apart] = strength * mu * (V[a] * V[b]) * body.smoothing.value(r) / r**2
    return NearPairs(pairs, weights)


def _reach(body: Body) -> float:
    """Distance beyond which the weights are too small to count [m]."""
    spacing, support = float(body.particles.spacings.max()), body.smoothing.support_radius
    r = np.linspace(spacing, support, 1001)
    weights = body.smoothing.value(r) / r**2
    return float(r[np.flatnonzero(weights >= _SMALLEST_WEIGHT * weights[0])[-1]])


class Penalty(ABC):
    """The penalty of one body, linear in its displacements: force = -K u in every component."""

    @property
    @abstractmethod
    def moments(self) -> Array:
        """Sum over b of c_ab |X_ab|^2, (n,) [J]."""

    @property
    @abstractmethod
    def bytes(self) -> int:
        """Memory of the arrays kept."""

    @abstractmethod
    def forces(self, displacements: Array) -> Array:
        """Forces (n, d) [N] from displacements (n, d) [m]."""

    @abstractmethod
    def squares(self, displacements: Array) -> Array:
        """Sum over b of c_ab |e_ab|^2, (n,) [J], from displacements (n, d)."""

    @abstractmethod
    def matrix(self) -> csr_array:
        """K (n, n) [N/m], with neighbours of neighbours of neighbours: in 3D, large."""


@final
@attrs.frozen(eq=False)
class PenaltyProducts(Penalty):
    """The penalty as products of sparse matrices, K = J^T Z J."""

    near: NearPairs
    moments: Array
    jet: csr_array  # J, ((1 + d) n, n): u, then its derivative along each axis
    pull: csr_array  # Z, ((1 + d) n, (1 + d) n), symmetric: minus forces and stresses of a jet

    @classmethod
    def of(cls, body: Body, strength: float) -> PenaltyProducts:
        """The penalty of a body."""
        near = near_pairs(body, strength)
        a, b = near.pairs.rows, near.pairs.columns
        return cls(near, near.moments(), jet(body), pull(body, a, b, near.weights))

    @property
    def bytes(self) -> int:
        own, pairs = (self.near.weights, self.moments), self.near.pairs
        lists = (pairs.starts, pairs.rows, pairs.columns, pairs.offsets, pairs.distances)
        matrices = [(m.data, m.indices, m.indptr) for m in (self.jet, self.pull)]
        return sum(array.nbytes for group in (own, lists, *matrices) for array in group)

    def forces(self, displacements: Array) -> Array:
        forces: Array = -(self.jet.T @ (self.pull @ (self.jet @ displacements)))
        return forces

    def squares(self, displacements: Array) -> Array:
        n, d = displacements.shape
        along = (self.jet @ displacements).reshape(1 + d, n, d)[1:]
        return self.near.squares(displacements, along.transpose(1, 2, 0))

    def matrix(self) -> csr_array:
        return csr_array(self.jet.T @ (self.pull @ self.jet))


def jet(body: Body) -> csr_array:
    """J, ((1 + d) n, n): from a field to itself and its derivatives along each axis."""
    pairs, particles = body.pairs(), body.particles
    kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
    weights = body.formulation.gradient.weights(pairs, kernel_gradients, particles.cells)
    along = [pairs.matrix(weights[:, axis]) for axis in range(weights.shape[1])]
    return csr_array(vstack([eye_array(pairs.row_count, format="csr"), *along], format="csr"))


def pull(body: Body, a: Indices, b: Indices, weights: Array) -> csr_array:
    """Z, ((1 + d) n, (1 + d) n) [N/m, N, N m]: the energy of jets q is q Z q / 2.

    Ordered pairs a, b have `weights` c_ab, all (m,).
    """
    once = np.flatnonzero((weights > 0.0) & (a < b))  # e_ba = -e_ab
    a, b, c = a[once], b[once], weights[once]
    X, n = body.particles.positions, body.particles.count
    take_a, take_b = (
        csr_array((np.ones(len(c)), (np.arange(len(c)), end)), shape=(len(c), n)) for end in (a, b)
    )
    both = take_a + take_b
    halves = [diags_array(0.5 * (X[b] - X[a])[:, axis]) @ both for axis in range(X.shape[1])]
    errors = csr_array(hstack([take_a - take_b, *halves], format="csr"))
    return csr_array(errors.T @ diags_array(c) @ errors)
