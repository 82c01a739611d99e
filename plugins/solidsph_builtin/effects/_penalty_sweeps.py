"""The penalty as compiled sweeps over the near pairs, for bodies of many particles."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple, final

import attrs
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solidsph.arrays import Array
from solidsph.body import Body
from solidsph.engines.compiled.engine import CompiledBody, CompiledEngine, CompiledForces
from solidsph_builtin.divergences.variational import Variational
from solidsph_builtin.effects._penalty import Penalty, jet, near_pairs, pull
from solidsph_builtin.formulations.total_lagrangian import TotalLagrangian
from solidsph_builtin.materials.linear_elastic import LinearElastic


@final
@attrs.frozen(eq=False)
class PenaltySweeps(Penalty):
    """Three sweeps: gather H, pull the near pairs together, scatter the stress that they make.

    The first and the last are the engine's, on weights that a lattice shares between particles.
    """

    operator: CompiledBody  # the gradient and its transpose; its material is not used
    moments: Array
    columns: NDArray[np.int32]  # (k,) particle b of every near pair of a, without a itself
    starts: NDArray[np.int64]  # (n + 1,)
    weights: Array  # (k,) c_ab [N/m]

    @classmethod
    def of(cls, body: Body, strength: float) -> PenaltySweeps:
        """The penalty of a body."""
        near = near_pairs(body, strength)
        kept = near.weights > 0.0
        counts = np.bincount(near.pairs.rows[kept], minlength=near.pairs.row_count)
        return cls(
            operator=_operator(body),
            moments=near.moments(),
            columns=near.pairs.columns[kept].astype(np.int32),
            starts=np.concatenate([[0], np.cumsum(counts)]),
            weights=near.weights[kept],
        )

    @property
    def bytes(self) -> int:
        own = (self.moments, self.columns, self.starts, self.weights)
        return sum(array.nbytes for array in own) + self.operator.bytes

    def forces(self, displacements: Array) -> Array:
        n, d = displacements.shape
        stress, forces, spread = (np.empty(shape) for shape in ((d, d, n), (n, d), (n, d)))
        particles = self.operator.body.particles
        _loops(d).pull(
            self.starts,
            self.columns,
            self.weights,
            particles.positions,
            particles.volumes,
            self._jets(displacements),
            forces,
            stress,
        )
        self.operator.spread(stress, spread)
        return forces + spread

    def squares(self, displacements: Array) -> Array:
        n, d = displacements.shape
        squares = np.empty(n)
        _loops(d).square(
            self.starts,
            self.columns,
            self.weights,
            self.operator.body.particles.positions,
            self._jets(displacements),
            squares,
        )
        return squares

    def _jets(self, displacements: Array) -> Array:
        """Displacement and half its gradient, component by component, (n, d, 1 + d)."""
        n, d = displacements.shape
        jets = np.empty((n, d, 1 + d))
        jets[:, :, 0] = displacements
        jets[:, :, 1:] = 0.5 * self.operator.gradient_of(displacements).transpose(2, 0, 1)
        return jets

    def matrix(self) -> csr_array:
        body = self.operator.body
        a = np.repeat(np.arange(body.particles.count), np.diff(self.starts))
        J, Z = jet(body), pull(body, a, self.columns.astype(np.intp), self.weights)
        return csr_array(J.T @ (Z @ J))


def _operator(body: Body) -> CompiledBody:
    """The body's gradient and its transpose; a linear law compiles for every gradient."""
    linear = attrs.evolve(
        body,
        material=LinearElastic(density=1.0, youngs_modulus=1.0, poissons_ratio=0.0),
        formulation=TotalLagrangian(gradient=body.formulation.gradient, divergence=Variational()),
    )
    prepared = CompiledEngine().prepare([linear], [])
    assert isinstance(prepared, CompiledForces)
    (operator,) = prepared.parts
    return operator


class _Loops(NamedTuple):
    """Compiled loops over near pairs."""

    # (starts, columns, weights, X, volumes, jets, forces (n, d), stress (d, d, n) over volume)
    pull: Any
    # (starts, columns, weights, X, jets, squares (n,))
    square: Any


@cache
def _loops(dimension: int) -> _Loops:
    """The loops for one dimension."""
    d = dimension
    zeros, offset, row, error, more = _words(dimension)

    @njit(parallel=True)
    def pulled(starts, columns, weights, X, volumes, jets, forces, stress):
        for a in prange(len(forces)):
            # Force and products of each component; those of missing dimensions are not used.
            nothing = zeros()
            sums_x, sums_y, sums_z = nothing, nothing, nothing
            own_x = row(jets, a, 0)
            if d > 1:
                own_y = row(jets, a, 1)
            if d > 2:
                own_z = row(jets, a, 2)
            for k in range(starts[a], starts[a + 1]):
                b, c = columns[k], weights[k]
                o = offset(X, a, b)
                sums_x = more(sums_x, c * error(own_x, jets, b, 0, o), o)
                if d > 1:
                    sums_y = more(sums_y, c * error(own_y, jets, b, 1, o), o)
                if d > 2:
                    sums_z = more(sums_z, c * error(own_z, jets, b, 2, o), o)
            sums = (sums_x, sums_y, sums_z)
            for i in range(d):
                forces[a, i] = -sums[i][0]
                for k in range(d):
                    stress[i, k, a] = 0.5 * sums[i][1 + k] / volumes[a]

    @njit(parallel=True)
    def square(starts, columns, weights, X, jets, squares):
        for a in prange(len(squares)):
            total = 0.0
            for k in range(starts[a], starts[a + 1]):
                b = columns[k]
                o = offset(X, a, b)
                for i in range(d):
                    total += weights[k] * error(row(jets, a, i), jets, b, i, o) ** 2
            squares[a] = total

    return _Loops(pulled, square)


def _words(dimension: int) -> tuple[Any, Any, Any, Any, Any]:
    """Compiled: empty sums, offset of b from a, a row of a jet, its e_ab, and sums with one more.

    e_ba is minus e_ab to the last bit, so that the forces on the two cancel.
    """
    if dimension == 1:

        @njit
        def zeros():
            return 0.0, 0.0

        @njit
        def offset(X, a, b):
            return (X[b, 0] - X[a, 0],)

        @njit
        def row(jets, a, i):
            return jets[a, i, 0], jets[a, i, 1]

        @njit
        def error(own, jets, b, i, o):
            return own[0] - jets[b, i, 0] + (own[1] + jets[b, i, 1]) * o[0]

        @njit
        def more(sums, e, o):
            return sums[0] + e, sums[1] + e * o[0]

    elif dimension == 2:

        @njit
        def zeros():
            return 0.0, 0.0, 0.0

        @njit
        def offset(X, a, b):
            return X[b, 0] - X[a, 0], X[b, 1] - X[a, 1]

        @njit
        def row(jets, a, i):
            return jets[a, i, 0], jets[a, i, 1], jets[a, i, 2]

        @njit
        def error(own, jets, b, i, o):
            along = (own[1] + jets[b, i, 1]) * o[0] + (own[2] + jets[b, i, 2]) * o[1]
            return own[0] - jets[b, i, 0] + along

        @njit
        def more(sums, e, o):
            return sums[0] + e, sums[1] + e * o[0], sums[2] + e * o[1]

    else:

        @njit
        def zeros():
            return 0.0, 0.0, 0.0, 0.0

        @njit
        def offset(X, a, b):
            return X[b, 0] - X[a, 0], X[b, 1] - X[a, 1], X[b, 2] - X[a, 2]

        @njit
        def row(jets, a, i):
            return (
                jets[a, i, 0],
                jets[a, i, 1],
                jets[a, i, 2],
                jets[a, i, 3],
            )

        @njit
        def error(own, jets, b, i, o):
            along = (own[1] + jets[b, i, 1]) * o[0] + (own[2] + jets[b, i, 2]) * o[1]
            return own[0] - jets[b, i, 0] + along + (own[3] + jets[b, i, 3]) * o[2]

        @njit
        def more(sums, e, o):
            return sums[0] + e, sums[1] + e * o[0], sums[2] + e * o[1], sums[3] + e * o[2]

    return zeros, offset, row, error, more
