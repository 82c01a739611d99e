"""Cholesky factors of a sparse matrix whose rows are ordered so that its entries form a band."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from solidsph.maths.arrays import Array, Indices
from solidsph.maths.one_thread import one_thread

MOST_IN_BAND = 60_000_000
"""Numbers that are worth their memory, half a gigabyte."""

# Difference from its transpose that is rounding, over the largest number on the diagonal.
_ROUNDING = 1e-9


@attrs.frozen(eq=False)
class BandFactors:
    """Factors L L^T of a symmetric positive definite matrix, in LAPACK's band storage."""

    order: Indices  # (k,) of the rows in the band
    lower: Array  # (width + 1, k): row i has L[j + i, j] at column j

    def solve(self, values: Array) -> Array:
        """Solution of K x = `values`, (k,) or (k, m)."""
        solution = np.empty_like(values)
        with one_thread():
            solution[self.order] = dpbtrs(self.lower, values[self.order], lower=1)[0]
        return solution


def band_factors(matrix: csr_array) -> BandFactors | None:
    """Factors of `matrix` (k, k); None if it is not symmetric and positive definite, or if the band
    would be too wide for the memory.

    Slender and small bodies have narrow bands, in which LAPACK takes a quarter to a tenth of the
    time of a sparse factorisation. Rows are in the order of Cuthill and McKee (1969), reversed.
    """
    difference, largest = (matrix - matrix.T).data, np.abs(matrix.diagonal()).max(initial=0.0)
    if np.abs(difference).max(initial=0.0) > _ROUNDING * largest:
        return None
    count = matrix.shape[0]
    order = reverse_cuthill_mckee(matrix, symmetric_mode=True).astype(np.intp)
    places = np.empty(count, dtype=np.intp)
    places[order] = np.arange(count)
    rows, columns = np.repeat(places, np.diff(matrix.indptr)), places[matrix.indices]
    below = rows - columns
    width = int(below.max(initial=0))
    if (width + 1) * count > MOST_IN_BAND:
        return None
    band = np.zeros((width + 1, count), order="F")
    lower = below >= 0
    band[below[lower], columns[lower]] = matrix.data[lower]
    with one_thread():
        factors, info = dpbtrf(band, lower=1, overwrite_ab=1)
    return None if info else BandFactors(order, factors)
