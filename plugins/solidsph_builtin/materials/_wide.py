"""Tensors of one and two dimensions as (3, 3): the missing stretches are 1."""

from __future__ import annotations

from solidsph.maths.arrays import Tensor


def widened(F: Tensor) -> Tensor:
    """The deformation gradient (3, 3) of uniaxial or plane strain."""
    return _filled(F, 1.0)


def widened_change(dF: Tensor) -> Tensor:
    """The change (3, 3) of such a deformation gradient; the missing stretches do not change."""
    return _filled(dF, 0.0)


def _filled(A: Tensor, missing: float) -> Tensor:
    if len(A) == 1:
        return ((A[0][0], 0.0, 0.0), (0.0, missing, 0.0), (0.0, 0.0, missing))
    if len(A) == 2:
        return ((A[0][0], A[0][1], 0.0), (A[1][0], A[1][1], 0.0), (0.0, 0.0, missing))
    return (
        (A[0][0], A[0][1], A[0][2]),
        (A[1][0], A[1][1], A[1][2]),
        (A[2][0], A[2][1], A[2][2]),
    )


def narrowed(A: Tensor, like: Tensor) -> Tensor:
    """The components of a tensor (3, 3) in the dimensions of `like`."""
    if len(like) == 1:
        return ((A[0][0],),)
    if len(like) == 2:
        return ((A[0][0], A[0][1]), (A[1][0], A[1][1]))
    return _filled(A, 0.0)
