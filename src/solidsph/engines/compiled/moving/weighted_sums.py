"""Sums over the neighbours of moving particles, with weights from functions of arrays."""

from __future__ import annotations

from functools import cache
from typing import Any, final

import attrs

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.moving.neighbourhoods import Place
from solidsph.engines.compiled.vectors import MATRIX, ROW, with_outer, with_product
from solidsph.interfaces.formulation import Formulation
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs


@final
@attrs.define(eq=False)
class WeightedSums:
    """Both sums of a body whose gradient or divergence is a function of all pairs together."""

    formulation: Formulation
    pairs: Pairs | None = None
    weights: Array | None = None  # (m, d) the gradient's [1/m]

    def gradients(self, place: Place, u: Array, out: Array) -> None:
        """Fill `out` (n, d, d) with the gradients of u (n, d)."""
        self.pairs = pairs = place.rows.pairs(place.positions)
        kernel_gradients = -place.rows.slopes[: pairs.count, None] * pairs.offsets
        self.weights = self.formulation.gradient.weights(pairs, kernel_gradients, place.cells)
        _gather(u.shape[1])(place.rows, self.weights, u, out)

    def forces(self, place: Place, stress: Array, out: Array) -> None:
        """Fill `out` (n, d) with the forces of a stress (n, d, d), after `gradients`."""
        assert self.pairs is not None, "gradients come first"
        assert self.weights is not None, "gradients come first"
        weights = self.formulation.divergence.weights(self.pairs, self.weights, place.volumes)
        _force(out.shape[1])(place.rows, weights, stress, out)


@cache
def _gather(dimension: int) -> Any:
    row, zero = ROW[dimension], (0.0,) * dimension
    nothing = (zero,) * dimension

    @njit
    def gather(rows, weights, u, gradients):
        for p in range(len(u)):
            H = nothing
            for m in range(rows.starts[p], rows.starts[p + 1]):
                H = with_outer(H, row(u, rows.columns[m]), row(weights, m))
            for i in range(dimension):
                for k in range(dimension):
                    gradients[p, i, k] = H[i][k]

    return gather


@cache
def _force(dimension: int) -> Any:
    row, matrix, zero = ROW[dimension], MATRIX[dimension], (0.0,) * dimension

    @njit
    def force(rows, weights, stress, forces):
        for p in range(len(forces)):
            f = zero
            for m in range(rows.starts[p], rows.starts[p + 1]):
                f = with_product(f, matrix(stress, rows.columns[m]), row(weights, m))
            for i in range(dimension):
                forces[p, i] = f[i]

    return force
