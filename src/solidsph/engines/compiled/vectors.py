"""Vectors and tensors as nested tuples, which compiled loops keep in registers."""

from __future__ import annotations

from typing import Any

from solidsph.engines.compiled.jit import njit
from solidsph.maths.arrays import Array, Scalar, Tensor

Vector = Any  # a tuple of 1, 2 or 3 numbers


@njit
def _row_1(array: Array, at: int) -> Vector:
    return (array[at, 0],)


@njit
def _row_2(array: Array, at: int) -> Vector:
    return array[at, 0], array[at, 1]


@njit
def _row_3(array: Array, at: int) -> Vector:
    return array[at, 0], array[at, 1], array[at, 2]


@njit
def _matrix_1(array: Array, at: int) -> Tensor:
    return ((array[at, 0, 0],),)


@njit
def _matrix_2(array: Array, at: int) -> Tensor:
    return ((array[at, 0, 0], array[at, 0, 1]), (array[at, 1, 0], array[at, 1, 1]))


@njit
def _matrix_3(array: Array, at: int) -> Tensor:
    return (
        (array[at, 0, 0], array[at, 0, 1], array[at, 0, 2]),
        (array[at, 1, 0], array[at, 1, 1], array[at, 1, 2]),
        (array[at, 2, 0], array[at, 2, 1], array[at, 2, 2]),
    )


ROW = {1: _row_1, 2: _row_2, 3: _row_3}
"""Compiled (array (n, d), at) -> vector, by dimension."""

MATRIX = {1: _matrix_1, 2: _matrix_2, 3: _matrix_3}
"""Compiled (array (n, d, d), at) -> tensor, by dimension."""

IDENTITY = {d: tuple(tuple(float(i == k) for k in range(d)) for i in range(d)) for d in ROW}
"""I as nested tuples, by dimension."""


@njit
def moved(a: Vector, s: float, b: Vector) -> Vector:
    """a + s b."""
    if len(a) == 1:
        return (a[0] + s * b[0],)
    if len(a) == 2:
        return a[0] + s * b[0], a[1] + s * b[1]
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@njit
def times(s: float, a: Vector) -> Vector:
    """s a."""
    if len(a) == 1:
        return (s * a[0],)
    if len(a) == 2:
        return s * a[0], s * a[1]
    return s * a[0], s * a[1], s * a[2]


@njit
def with_outer(A: Tensor, a: Vector, b: Vector) -> Tensor:
    """A + a (x) b."""
    if len(a) == 1:
        return (moved(A[0], a[0], b),)
    if len(a) == 2:
        return moved(A[0], a[0], b), moved(A[1], a[1], b)
    return moved(A[0], a[0], b), moved(A[1], a[1], b), moved(A[2], a[2], b)


@njit
def dot(a: Vector, b: Vector) -> Scalar:
    """a . b."""
    if len(a) == 1:
        return a[0] * b[0]
    if len(a) == 2:
        return a[0] * b[0] + a[1] * b[1]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def with_product(f: Vector, T: Tensor, g: Vector) -> Vector:
    """f + T g."""
    if len(f) == 1:
        return (f[0] + dot(T[0], g),)
    if len(f) == 2:
        return f[0] + dot(T[0], g), f[1] + dot(T[1], g)
    return f[0] + dot(T[0], g), f[1] + dot(T[1], g), f[2] + dot(T[2], g)
