"""Factors of a sparse stiffness matrix."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from solidsph.errors import PortableError
from solidsph.maths.arrays import Array
from solidsph.maths.band import BandFactors, LastLayout, band_factors

# Smaller eigenvalues of the matrix scaled to a unit diagonal are rounding.
_SINGULAR = 1e-13


class SingularError(PortableError):
    """The matrix is singular to working precision."""

    def __init__(self, freedom: int | None) -> None:
        self.freedom = freedom  # where the motion without stiffness is largest, if known
        super().__init__(f"no stiffness in row {freedom}")


@attrs.frozen(eq=False)
class Factors:
    """Factors of a matrix scaled to a unit diagonal."""

    scaling: Array  # (k,)
    scaled: BandFactors | SuperLU

    @property
    def positive(self) -> bool:
        """Whether a symmetric matrix is positive definite: all pivots are positive then.

        SuperLU copies its factors to tell, which takes as long as the factorisation.
        """
        if isinstance(self.scaled, BandFactors):
            return True
        return bool(np.all(self.scaled.U.diagonal() > 0.0))

    def solve(self, values: Array) -> Array:
        """Solution of K x = `values` (k,)."""
        solution: Array = self.scaling * self.scaled.solve(self.scaling * values)
        return solution


def factorise(matrix: csr_array, *, symmetric: bool, last: LastLayout | None = None) -> Factors:
    """Factorise `matrix` (k, k), whose layout is kept in `last` for the next one.

    A `symmetric` matrix is factorised in a band if it is positive definite and the band is not too
    wide. Else SuperLU orders it by minimum degree with pivots on its diagonal: half the time of the
    general ordering for a beam, a sixth for a square. Loads may make it slightly less than
    symmetric.

    Raises:
        SingularError: some motion has no stiffness to working precision.
    """
    diagonal = np.abs(matrix.diagonal())
    if not np.all(np.isfinite(matrix.data)):
        raise SingularError(int(np.argmin(np.isfinite(matrix.sum(axis=1)))))
    empty = diagonal <= _SINGULAR * diagonal.max(initial=0.0)
    if empty.any():
        raise SingularError(int(np.argmax(empty)))
    scaling = 1.0 / np.sqrt(diagonal)
    both = np.repeat(scaling, np.diff(matrix.indptr)) * scaling[matrix.indices]
    scaled = csr_array((matrix.data * both, matrix.indices, matrix.indptr), shape=matrix.shape)
    factors = (band_factors(scaled, last) if symmetric else None) or _sparse_factors(
        scaled, symmetric
    )
    # The response to a random force is largest along the softest eigenvector.
    probe = np.random.default_rng(0).standard_normal(len(scaling))
    softest = factors.solve(probe)
    if not np.linalg.norm(softest) * _SINGULAR < np.linalg.norm(probe):
        finite = np.isfinite(softest).all()
        raise SingularError(int(np.argmax(np.abs(softest))) if finite else None)
    return Factors(scaling, factors)


def _sparse_factors(matrix: csr_array, symmetric: bool) -> SuperLU:
    try:
        if symmetric:
            return splu(
                csc_array(matrix),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        return splu(csc_array(matrix), permc_spec="COLAMD")
    except RuntimeError:  # a pivot is exactly zero; SuperLU does not report which
        raise SingularError(None) from None
