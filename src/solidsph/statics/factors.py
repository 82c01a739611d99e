"""Factors of a sparse stiffness, and what they tell about it."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from solidsph.arrays import Array

# A pivot of the matrix scaled to a unit diagonal: below this it is rounding.
_SINGULAR = 1e-13


class SingularError(Exception):
    """The matrix has no inverse to working precision; for callers here, who know what it means."""

    def __init__(self, freedom: int | None) -> None:
        self.freedom = freedom  # the row to blame, if it is known
        super().__init__(f"no pivot in row {freedom}")


@attrs.frozen(eq=False)
class Factors:
    """LU factors of the matrix scaled to a unit diagonal."""

    scaling: Array  # (k,)
    lu: SuperLU
    stable: bool  # a symmetric matrix only: whether it is positive definite

    def solve(self, values: Array) -> Array:
        """K^-1 times values (k,)."""
        solution: Array = self.scaling * self.lu.solve(self.scaling * values)
        return solution


def factorised(matrix: csr_array, *, symmetric: bool) -> Factors:
    """Factors of `matrix` (k, k).

    A symmetric one is ordered by minimum degree and pivots on its diagonal, which fills least:
    half the time of the general ordering for a beam, a sixth for a square. The signs of its
    pivots are those of its eigenvalues.

    Raises:
        SingularError: a row or a pivot vanishes.
    """
    diagonal = np.abs(matrix.diagonal())
    if not np.all(np.isfinite(matrix.data)):
        raise SingularError(int(np.argmin(np.isfinite(matrix.sum(axis=1)))))
    empty = diagonal <= _SINGULAR * diagonal.max(initial=0.0)
    if empty.any():
        raise SingularError(int(np.argmax(empty)))
    scaling = 1.0 / np.sqrt(diagonal)
    scaled = csc_array(diags_array(scaling) @ matrix @ diags_array(scaling))
    try:
        if symmetric:
            lu = splu(
                scaled,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        else:
            lu = splu(scaled, permc_spec="COLAMD")
    except RuntimeError:  # a pivot that is exactly zero; SuperLU does not say which
        raise SingularError(None) from None
    pivots = lu.U.diagonal()
    smallest = int(np.argmin(np.abs(pivots)))
    if not np.abs(pivots[smallest]) > _SINGULAR:
        raise SingularError(int(np.flatnonzero(lu.perm_c == smallest)[0]))
    return Factors(scaling, lu, bool(symmetric and np.all(pivots > 0.0)))
