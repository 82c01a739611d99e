"""Pointwise tensor algebra: the same functions for arrays of points and for single points.

A tensor is anything indexed `T[i][j]` with `len(T)` = 1, 2 or 3: nested tuples of scalars, or an
array with component axes first, (d, d, n). Results are nested tuples. The functions allocate
nothing, so a compiler can inline them into a loop over particles; it resolves the branches on
`len(T)`.

In one and two dimensions the missing stretches are 1 (uniaxial strain, plane strain).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solidsph.maths.arrays import Array, Scalar, Tensor, Vector


def identity(like: Tensor) -> Tensor:
    """I of the dimension of `like`."""
    if len(like) == 1:
        return ((1.0,),)
    if len(like) == 2:
        return ((1.0, 0.0), (0.0, 1.0))
    return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def trace(A: Tensor) -> Scalar:
    """tr A."""
    if len(A) == 1:
        return A[0][0]
    if len(A) == 2:
        return A[0][0] + A[1][1]
    return A[0][0] + A[1][1] + A[2][2]


def determinant(A: Tensor) -> Scalar:
    """det A."""
    if len(A) == 1:
        return A[0][0]
    if len(A) == 2:
        return A[0][0] * A[1][1] - A[0][1] * A[1][0]
    return (
        A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1])
        + A[0][1] * (A[1][2] * A[2][0] - A[1][0] * A[2][2])
        + A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0])
    )


def cofactor(A: Tensor) -> Tensor:
    """cof A = det(A) A^-T, defined for singular A too."""
    if len(A) == 1:
        return ((1.0,),)
    if len(A) == 2:
        return ((A[1][1], -A[1][0]), (-A[0][1], A[0][0]))
    return (
        (
            A[1][1] * A[2][2] - A[1][2] * A[2][1],
            A[1][2] * A[2][0] - A[1][0] * A[2][2],
            A[1][0] * A[2][1] - A[1][1] * A[2][0],
        ),
        (
            A[0][2] * A[2][1] - A[0][1] * A[2][2],
            A[0][0] * A[2][2] - A[0][2] * A[2][0],
            A[0][1] * A[2][0] - A[0][0] * A[2][1],
        ),
        (
            A[0][1] * A[1][2] - A[0][2] * A[1][1],
            A[0][2] * A[1][0] - A[0][0] * A[1][2],
            A[0][0] * A[1][1] - A[0][1] * A[1][0],
        ),
    )


def transpose(A: Tensor) -> Tensor:
    """A^T."""
    if len(A) == 1:
        return ((A[0][0],),)
    if len(A) == 2:
        return ((A[0][0], A[1][0]), (A[0][1], A[1][1]))
    return (
        (A[0][0], A[1][0], A[2][0]),
        (A[0][1], A[1][1], A[2][1]),
        (A[0][2], A[1][2], A[2][2]),
    )


def dot(v: Vector, w: Vector) -> Scalar:
    """v . w."""
    if len(v) == 1:
        return v[0] * w[0]
    if len(v) == 2:
        return v[0] * w[0] + v[1] * w[1]
    return v[0] * w[0] + v[1] * w[1] + v[2] * w[2]


def scaled(a: Scalar, v: Vector) -> Vector:
    """a v."""
    if len(v) == 1:
        return (a * v[0],)
    if len(v) == 2:
        return (a * v[0], a * v[1])
    return (a * v[0], a * v[1], a * v[2])


def scale(a: Scalar, A: Tensor) -> Tensor:
    """a A."""
    if len(A) == 1:
        return ((a * A[0][0],),)
    if len(A) == 2:
        return ((a * A[0][0], a * A[0][1]), (a * A[1][0], a * A[1][1]))
    return (
        (a * A[0][0], a * A[0][1], a * A[0][2]),
        (a * A[1][0], a * A[1][1], a * A[1][2]),
        (a * A[2][0], a * A[2][1], a * A[2][2]),
    )


def add(A: Tensor, B: Tensor) -> Tensor:
    """A + B."""
    if len(A) == 1:
        return ((A[0][0] + B[0][0],),)
    if len(A) == 2:
        return (
            (A[0][0] + B[0][0], A[0][1] + B[0][1]),
            (A[1][0] + B[1][0], A[1][1] + B[1][1]),
        )
    return (
        (A[0][0] + B[0][0], A[0][1] + B[0][1], A[0][2] + B[0][2]),
        (A[1][0] + B[1][0], A[1][1] + B[1][1], A[1][2] + B[1][2]),
        (A[2][0] + B[2][0], A[2][1] + B[2][1], A[2][2] + B[2][2]),
    )


def _row_times(a: Any, B: Tensor) -> Tensor:
    if len(B) == 1:
        return (a[0] * B[0][0],)
    if len(B) == 2:
        return (a[0] * B[0][0] + a[1] * B[1][0], a[0] * B[0][1] + a[1] * B[1][1])
    return (
        a[0] * B[0][0] + a[1] * B[1][0] + a[2] * B[2][0],
        a[0] * B[0][1] + a[1] * B[1][1] + a[2] * B[2][1],
        a[0] * B[0][2] + a[1] * B[1][2] + a[2] * B[2][2],
    )


def product(A: Tensor, B: Tensor) -> Tensor:
    """A B."""
    if len(A) == 1:
        return (_row_times(A[0], B),)
    if len(A) == 2:
        return (_row_times(A[0], B), _row_times(A[1], B))
    return (_row_times(A[0], B), _row_times(A[1], B), _row_times(A[2], B))


def contraction(A: Tensor, B: Tensor) -> Scalar:
    """A : B, the sum of products of components."""
    return trace(product(A, transpose(B)))


def inverse(A: Tensor) -> Tensor:
    """A^-1."""
    return scale(1.0 / determinant(A), transpose(cofactor(A)))


def inverse_transpose(A: Tensor) -> Tensor:
    """A^-T."""
    return scale(1.0 / determinant(A), cofactor(A))


def right_cauchy_green(F: Tensor) -> Tensor:
    """C = F^T F."""
    return product(transpose(F), F)


def green_lagrange(F: Tensor) -> Tensor:
    """E = (F^T F - I) / 2."""
    return scale(0.5, add(right_cauchy_green(F), scale(-1.0, identity(F))))


def small_strain(F: Tensor) -> Tensor:
    """epsilon = (F + F^T) / 2 - I, the strain of the linear theory."""
    return add(scale(0.5, add(F, transpose(F))), scale(-1.0, identity(F)))


def cauchy_stress(F: Tensor, P: Tensor) -> Tensor:
    """Push-forward of the first Piola-Kirchhoff stress: sigma = P F^T / J."""
    return scale(1.0 / determinant(F), product(P, transpose(F)))


def components_first(values: Array) -> Array:
    """Public (n, d, d) -> (d, d, n) of pointwise functions (a view)."""
    return np.moveaxis(values, 0, -1)


def particles_first(values: Tensor, count: int) -> Array:
    """Result of a pointwise function -> (count, d, d); constant components are broadcast."""
    d = len(values)
    out = np.empty((count, d, d))
    for i in range(d):
        for j in range(d):
            out[:, i, j] = values[i][j]
    return out


def largest_principal(stress: Array) -> Array:
    """Largest principal value of symmetric stresses (n, d, d), in the plane if d = 2, (n,)."""
    return np.asarray(np.linalg.eigvalsh(stress)[:, -1], dtype=np.float64)
