"""Cholesky factors of a sparse matrix whose rows are ordered so that its entries form a band."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray
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


@attrs.frozen(eq=False)
class BandLayout:
    """Where the entries of matrices (k, k) with one pattern stand in a band."""

    order: Indices  # (k,) of the rows in the band
    width: int  # diagonals of the lower triangle
    below: Indices  # entries on and below the diagonal of the band, of the data of the matrix
    places: Indices  # of these in the band, column by column
    above: Indices  # entries above the diagonal
    mirrored: Indices  # places of their mirror images
    alone: Indices  # entries below the diagonal without a mirror image

    @classmethod
    def of(cls, matrix: csr_array) -> BandLayout | None:
        """That of `matrix` (k, k); None if the band would be too wide for the memory.

        Rows are in the order of Cuthill and McKee (1969), reversed, or in their own if the band is
        narrower then, as that of a square is.
        """
        count = matrix.shape[0]
        order, place = _cuthill_mckee(matrix), np.empty(count, dtype=np.intp)
        place[order] = np.arange(count)
        own_rows: Indices = np.repeat(np.arange(count), np.diff(matrix.indptr))
        own_columns: Indices = matrix.indices.astype(np.intp)
        rows, columns = place[own_rows], place[own_columns]
        if _width(own_rows, own_columns) < _width(rows, columns):
            order, rows, columns = np.arange(count), own_rows, own_columns
        down, width = rows - columns, _width(rows, columns)
        if width * count > MOST_IN_BAND:
            return None
        below, above = np.flatnonzero(down >= 0), np.flatnonzero(down < 0)
        places = down[below] + columns[below] * width
        mirrored = rows[above] * width - down[above]
        has_image = np.zeros(width * count, dtype=np.bool_)
        has_image[mirrored] = True
        has_image[::width] = True  # the diagonal
        return cls(order, width, below, places, above, mirrored, below[~has_image[places]])

    def factors(self, data: Array) -> BandFactors | None:
        """Factors of the matrix with these entries; None if it is not symmetric and positive
        definite."""
        band = np.zeros((len(self.order), self.width))
        flat = band.ravel()
        flat[self.places] = data[self.below]
        allowed = _ROUNDING * np.abs(band[:, 0]).max(initial=0.0)
        for difference in (data[self.above] - flat[self.mirrored], data[self.alone]):
            if not np.abs(difference).max(initial=0.0) <= allowed:
                return None
        with one_thread():
            factors, info = dpbtrf(band.T, lower=1, overwrite_ab=1)
        return None if info else BandFactors(self.order, factors)


def _cuthill_mckee(matrix: csr_array) -> Indices:
    return np.asarray(reverse_cuthill_mckee(matrix, symmetric_mode=True), dtype=np.intp)


def _width(rows: Indices, columns: Indices) -> int:
    return 1 + int(np.abs(rows - columns).max(initial=0))


@attrs.define(eq=False)
class LastLayout:
    """The layout of the matrices whose pattern was met last."""

    pattern: tuple[NDArray[np.integer], NDArray[np.integer]] | None = None
    layout: BandLayout | None = None

    def of(self, matrix: csr_array) -> BandLayout | None:
        """That of `matrix`, or None, as of `BandLayout.of`."""
        starts, columns = self.pattern or (np.empty(0), np.empty(0))
        if not (np.array_equal(starts, matrix.indptr) and np.array_equal(columns, matrix.indices)):
            self.pattern, self.layout = (matrix.indptr, matrix.indices), BandLayout.of(matrix)
        return self.layout


def band_factors(matrix: csr_array, last: LastLayout | None = None) -> BandFactors | None:
    """Factors of `matrix` (k, k); None if it is not symmetric and positive definite, or if the band
    would be too wide for the memory.

    Slender and small bodies have narrow bands, in which LAPACK takes a quarter to a tenth of the
    time of a sparse factorisation. The layout is kept in `last` for matrices with the same pattern.
    """
    layout = (last or LastLayout()).of(matrix)
    return None if layout is None else layout.factors(matrix.data)
