"""Tensors of one and two dimensions as (3, 3): the missing stretches are 1."""

from __future__ import annotations

from solidsph.maths.arrays import Tensor


def widened(F: Tensor) -> Tensor:
    """The deformation gradient (3, 3) of uniaxial or plane strain."""
    if len(F) == 1:
        return ((F[0][0], 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    if len(F) == 2:
        return ((F[0][0], F[0][1], 0.0), (F[1][0], F[1][1], 0.0), (0.0, 0.0, 1.0))
    return (
        (F[0][0], F[0][1], F[0][2]),
        (F[1][0], F[1][1], F[1][2]),
        (F[2][0], F[2][1], F[2][2]),
    )


def widened_change(dF: Tensor) -> Tensor:
    """The change (3, 3) of such a deformation gradient; the missing stretches do not change."""
    if len(dF) == 1:
        return ((dF[0][0], 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    if len(dF) == 2:
        return ((dF[0][0], dF[0][1], 0.0), (dF[1][0], dF[1][1], 0.0), (0.0, 0.0, 0.0))
    return (
        (dF[0][0], dF[0][1], dF[0][2]),
        (dF[1][0], dF[1][1], dF[1][2]),
        (dF[2][0], dF[2][1], dF[2][2]),
    )


def narrowed(A: Tensor, like: Tensor) -> Tensor:
    """The components of a tensor (3, 3) in the dimensions of `like`."""
    if len(like) == 1:
        return ((A[0][0],),)
    if len(like) == 2:
        return ((A[0][0], A[0][1]), (A[1][0], A[1][1]))
    return (
        (A[0][0], A[0][1], A[0][2]),
        (A[1][0], A[1][1], A[1][2]),
        (A[2][0], A[2][1], A[2][2]),
    )
