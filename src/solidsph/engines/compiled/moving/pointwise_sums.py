"""Sums over the neighbours of moving particles, with weights by compiled formulas.

Weights are not stored: to compute them from the kernel's slope of a pair and from one matrix per
particle costs less than to load them from memory.
"""

from __future__ import annotations

from functools import cache
from typing import Any, final

import attrs
import numpy as np
from numba import types

from solidsph.engines.compiled.jit import njit
from solidsph.engines.compiled.moving.neighbourhoods import Place
from solidsph.engines.compiled.pointwise import (
    NotCompilableError,
    compiled_function,
    numbers,
    registered,
    tensor_type,
)
from solidsph.engines.compiled.vectors import (
    IDENTITY,
    MATRIX,
    ROW,
    moved,
    times,
    with_outer,
    with_product,
)
from solidsph.interfaces.body import Body
from solidsph.interfaces.divergence import Divergence, PointwiseDivergence
from solidsph.interfaces.gradient import Gradient, PointwiseGradient
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import product


@final
@attrs.frozen(eq=False)
class PointwiseSums:
    """Both sums of a body whose gradient and divergence are pointwise formulas."""

    gradient: Gradient
    gather: Any
    scatter: Any
    corrections: Array  # (n, d, d) K_p [-]
    own: Array  # (n, d) g_pp [1/m]

    @classmethod
    def of(cls, body: Body) -> PointwiseSums:
        """The sums of a body.

        Raises:
            NotCompilableError: its gradient or divergence is not pointwise, or does not compile.
        """
        n, d = body.particles.count, body.particles.dimension
        gradient, divergence = body.formulation.gradient, body.formulation.divergence
        if not isinstance(gradient, PointwiseGradient):
            raise NotCompilableError(f"{gradient} has no pointwise form")
        correction = None
        if gradient.is_corrected:
            correction = compiled_function(gradient.correction, tensor_type(d))
        corrects = correction is not None
        return cls(
            gradient,
            _gather(d, correction, gradient.of_differences),
            _adjoint(d, corrects) if divergence.adjoint else _pointwise(d, corrects, divergence),
            np.empty((n, d, d)),
            np.empty((n, d)),
        )

    def gradients(self, place: Place, u: Array, out: Array) -> None:
        """Fill `out` (n, d, d) with the gradients of u (n, d).

        Raises:
            BuildError: the neighbours of a particle do not determine a gradient.
        """
        done = self.gather(place, u, self.corrections, self.own, out)
        if not done:
            # The array form says whose neighbours they are.
            pairs = place.rows.pairs(place.positions)
            slopes = place.rows.slopes[: pairs.count]
            self.gradient.weights(pairs, -slopes[:, None] * pairs.offsets, place.cells)

    def forces(self, place: Place, stress: Array, out: Array) -> None:
        """Fill `out` (n, d) with the forces of a stress (n, d, d), after `gradients`."""
        self.scatter(place, self.corrections, self.own, stress, out)


@cache
def _gather(dimension: int, correction: Any, of_differences: bool) -> Any:
    """Loop (place, u, corrections, own, gradients) -> whether all K are finite."""
    row, identity = ROW[dimension], IDENTITY[dimension]
    nothing = tuple(tuple(0.0 for _ in r) for r in identity)
    corrects = correction is not None

    @njit(error_model="numpy")
    def gather(place, u, corrections, own, gradients):
        rows, positions, cells, _ = place
        unknown = 0.0
        for p in range(len(positions)):
            here, u_p = row(positions, p), row(u, p)
            moment = along = nothing
            total = times(0.0, here)  # not a number where the position is none
            for m in range(rows.starts[p], rows.starts[p + 1]):
                q = rows.columns[m]
                offset = moved(row(positions, q), -1.0, here)
                plain = times(-rows.slopes[m] * cells[q], offset)
                change = row(u, q)
                if of_differences:
                    change = moved(change, -1.0, u_p)
                along = with_outer(along, change, plain)
                total = moved(total, 1.0, plain)
                if corrects:
                    moment = with_outer(moment, offset, plain)
            K = identity
            if corrects:
                K = numbers(correction(moment))
            weight = with_product(nothing[0], K, total)
            for i in range(dimension):
                own[p, i] = -weight[i] if of_differences else 0.0 * weight[i]
                slope = with_product(nothing[0], K, along[i])
                for k in range(dimension):
                    gradients[p, i, k] = slope[k]
                    corrections[p, i, k] = K[i][k]
                    unknown += 0.0 * K[i][k]
        return unknown == 0.0

    return gather


@cache
def _adjoint(dimension: int, corrects: bool) -> Any:
    """Loop (place, corrections, own, stress, forces): the transpose."""
    row, matrix, zero = ROW[dimension], MATRIX[dimension], (0.0,) * dimension
    times_matrix = registered(product)

    @njit(error_model="numpy")
    def force(place, corrections, own, stress, forces):
        rows, positions, cells, volumes = place
        # K_q is applied to the stress once instead of to the slope of every pair (q, p).
        acting = np.empty_like(stress)
        for q in range(len(positions)):
            T = matrix(stress, q)
            if corrects:
                T = times_matrix(T, matrix(corrections, q))
            for i in range(dimension):
                for k in range(dimension):
                    acting[q, i, k] = volumes[q] * T[i][k]
        for p in range(len(positions)):
            f, here = zero, row(positions, p)
            for m in range(rows.starts[p], rows.starts[p + 1]):
                q = rows.columns[m]
                slope = times(rows.slopes[m], moved(row(positions, q), -1.0, here))
                f = with_product(f, matrix(acting, q), slope)
            from_self = with_product(zero, matrix(stress, p), row(own, p))
            for i in range(dimension):
                forces[p, i] = -cells[p] * f[i] - volumes[p] * from_self[i]

    return force


def _pointwise(dimension: int, corrects: bool, divergence: Divergence) -> Any:
    """Loop (place, corrections, own, stress, forces) for any other divergence."""
    if not isinstance(divergence, PointwiseDivergence):
        raise NotCompilableError(f"{divergence} has no pointwise form")
    pair_weight = compiled_function(divergence.pair_weight, *[types.float64] * 4)
    own_weight = compiled_function(divergence.own_weight, *[types.float64] * 2)
    return _by_formula(dimension, corrects, pair_weight, own_weight)


@cache
def _by_formula(dimension: int, corrects: bool, pair_weight: Any, own_weight: Any) -> Any:
    row, matrix, zero = ROW[dimension], MATRIX[dimension], (0.0,) * dimension

    @njit(error_model="numpy")
    def force(place, corrections, own, stress, forces):
        rows, positions, cells, volumes = place
        weights = np.zeros((1, dimension))
        for p in range(len(positions)):
            here, K_p = row(positions, p), matrix(corrections, p)
            for k in range(dimension):
                weights[0, k] = own_weight(own[p, k], volumes[p])
            f = with_product(times(0.0, row(own, p)), matrix(stress, p), row(weights, 0))
            for m in range(rows.starts[p], rows.starts[p + 1]):
                if m == rows.own[p]:
                    continue
                q = rows.columns[m]
                slope = times(-rows.slopes[m], moved(row(positions, q), -1.0, here))
                there, back = times(cells[q], slope), times(-cells[p], slope)
                if corrects:
                    there = with_product(zero, K_p, there)
                    back = with_product(zero, matrix(corrections, q), back)
                for k in range(dimension):
                    weights[0, k] = pair_weight(there[k], back[k], volumes[p], volumes[q])
                f = with_product(f, matrix(stress, q), row(weights, 0))
            for i in range(dimension):
                forces[p, i] = f[i]

    return force
