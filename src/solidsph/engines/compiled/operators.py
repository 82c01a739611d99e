"""Compiled loops over the rows of moving particles: weights, gradients, stresses and forces."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import njit, types

from solidsph.engines.compiled.pointwise import (
    NUMBERS,
    NotCompilableError,
    compiled_function,
    tensor_type,
)
from solidsph.engines.compiled.vectors import MATRIX, ROW, ZERO, moved, with_outer, with_product
from solidsph.interfaces.divergence import Divergence, PointwiseDivergence
from solidsph.interfaces.gradient import Gradient, PointwiseGradient


@njit
def kernel_sums(neighbours, values, cells, sums):
    """sums (n,) = sum over neighbours of W_pq by reference cells [-]."""
    for p in range(len(sums)):
        total = 0.0
        for m in range(neighbours.starts[p], neighbours.starts[p + 1]):
            total += values[m] * cells[neighbours.columns[m]]
        sums[p] = total


def weights_loop(gradient: Gradient, dimension: int) -> Any | None:
    """Compiled (neighbours, positions, slopes, volumes, weights (m, d)) -> whether they are formed.

    None: this gradient must be asked for its weights with arrays.
    """
    if not isinstance(gradient, PointwiseGradient):
        return None
    if not gradient.is_corrected:
        return _plain(dimension, gradient.of_differences)
    try:
        correction = compiled_function(gradient.correction, tensor_type(dimension))
    except NotCompilableError:
        return None
    return _corrected(dimension, correction, gradient.of_differences)


@cache
def _plain(dimension: int, of_differences: bool) -> Any:
    weigh = _row_of_weights(dimension, of_differences, _as_it_is)

    @njit(error_model="numpy")
    def loop(neighbours, positions, slopes, volumes, weights):
        for p in range(len(positions)):
            weigh(neighbours, positions, slopes, volumes, weights, p, 0.0)
        return True

    return loop


@njit
def _as_it_is(zero, K, plain):
    return plain


@cache
def _corrected(dimension: int, correction: Any, of_differences: bool) -> Any:
    row, zero, numbers = ROW[dimension], ZERO[dimension], NUMBERS[dimension]
    nothing = (zero,) * dimension
    weigh = _row_of_weights(dimension, of_differences, with_product)

    @njit(error_model="numpy")
    def loop(neighbours, positions, slopes, volumes, weights):
        finite = 0.0
        for p in range(len(positions)):
            moment, here = nothing, row(positions, p)
            for m in range(neighbours.starts[p], neighbours.starts[p + 1]):
                q = neighbours.columns[m]
                offset = moved(row(positions, q), -1.0, here)
                moment = with_outer(moment, offset, moved(zero, -slopes[m] * volumes[q], offset))
            K = numbers(correction(moment))
            for k in K:
                for component in k:
                    finite += 0.0 * component
            weigh(neighbours, positions, slopes, volumes, weights, p, K)
        return finite == 0.0

    return loop


@cache
def _row_of_weights(dimension: int, of_differences: bool, times: Any) -> Any:
    row, zero = ROW[dimension], ZERO[dimension]

    @njit(error_model="numpy")
    def weigh(neighbours, positions, slopes, volumes, weights, p, K):
        here, total = row(positions, p), zero
        for m in range(neighbours.starts[p], neighbours.starts[p + 1]):
            q = neighbours.columns[m]
            offset = moved(row(positions, q), -1.0, here)
            weight = times(zero, K, moved(zero, -slopes[m] * volumes[q], offset))
            total = moved(total, 1.0, weight)
            for k in range(dimension):
                weights[m, k] = weight[k]
        if of_differences:
            own = neighbours.own[p]
            for k in range(dimension):  # the slope of the pair (p, p) is 0, so it has added nothing
                weights[own, k] = -total[k]

    return weigh


@cache
def stress_loop(dimension: int, law: Any) -> Any:
    """Compiled (neighbours, weights, displacements, params, T (n, d, d)): T of a law (H, params)."""
    row = ROW[dimension]
    nothing = (ZERO[dimension],) * dimension

    @njit(error_model="numpy")
    def loop(neighbours, weights, displacements, params, out):
        for p in range(len(displacements)):
            H = nothing
            for m in range(neighbours.starts[p], neighbours.starts[p + 1]):
                u = row(displacements, neighbours.columns[m])
                H = with_outer(H, u, row(weights, m))
            T = law(H, params)
            for i in range(dimension):
                for k in range(dimension):
                    out[p, i, k] = T[i][k]

    return loop


def force_loop(divergence: Divergence, dimension: int) -> Any | None:
    """Compiled (neighbours, gradient's weights, volumes, stress (n, d, d), forces (n, d)).

    None: this divergence must be asked for its weights with arrays.
    """
    if not isinstance(divergence, PointwiseDivergence):
        return None
    number = types.float64
    try:
        pair_weight = compiled_function(divergence.pair_weight, *[number] * 4)
        own_weight = compiled_function(divergence.own_weight, *[number] * 2)
    except NotCompilableError:
        return None
    return _pointwise_forces(dimension, pair_weight, own_weight)


@cache
def _pointwise_forces(dimension: int, pair_weight: Any, own_weight: Any) -> Any:
    row, matrix, zero = ROW[dimension], MATRIX[dimension], ZERO[dimension]

    @njit(error_model="numpy")
    def loop(neighbours, weights, volumes, stress, forces):
        d_pq = np.zeros((1, dimension))
        for p in range(len(forces)):
            f, own = zero, neighbours.own[p]
            for m in range(neighbours.starts[p], neighbours.starts[p + 1]):
                q, back = neighbours.columns[m], neighbours.reverse[m]
                for k in range(dimension):
                    if m == own:
                        d_pq[0, k] = own_weight(weights[m, k], volumes[p])
                    else:
                        d_pq[0, k] = pair_weight(
                            weights[m, k], weights[back, k], volumes[p], volumes[q]
                        )
                f = with_product(f, matrix(stress, q), row(d_pq, 0))
            for i in range(dimension):
                forces[p, i] = f[i]

    return loop


@cache
def weighted_forces(dimension: int) -> Any:
    """Compiled (neighbours, divergence's weights (m, d), stress (n, d, d), forces (n, d))."""
    row, matrix, zero = ROW[dimension], MATRIX[dimension], ZERO[dimension]

    @njit
    def loop(neighbours, weights, stress, forces):
        for p in range(len(forces)):
            f = zero
            for m in range(neighbours.starts[p], neighbours.starts[p + 1]):
                f = with_product(f, matrix(stress, neighbours.columns[m]), row(weights, m))
            for i in range(dimension):
                forces[p, i] = f[i]

    return loop
