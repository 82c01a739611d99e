"""Upper bound on the largest eigenvalue of an operator, from few applications."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class SpectralBound:
    """What is known of the largest eigenvalue."""

    estimate: float  # largest Ritz value, from below for a symmetric operator
    bound: float  # the estimate and its residual
    vector: Array  # (m,) unit vector of the estimate

    @property
    def gap(self) -> float:
        """Share of the bound by which it may be too large."""
        return 1.0 - self.estimate / self.bound if self.bound > 0.0 else 0.0


def spectral_bound(
    apply: Callable[[Array], Array], start: Array, *, least: int, most: int, gap: float = 0.0
) -> SpectralBound | None:
    """Bound of the largest real part of the eigenvalues, by Arnoldi iteration.

    The bound is the largest Ritz value plus the norm of its residual: safe in practice once a few
    vectors are there, if the start has a part of every eigenvector (Zhou & Li 2011, Bounding the
    spectrum of large Hermitian matrices). For an operator without symmetry it errs to the side of
    the numerical range, which holds the spectrum.

    Args:
        apply: the operator.
        start: (m,), not zero.
        least: vectors from which on the bound is trusted.
        most: vectors, and applications, at most.
        gap: stops once the bound is no further than this share of it from the estimate.

    Returns:
        None if a product is not finite.
    """
    most = min(most, len(start))
    basis = np.empty((most, len(start)))
    projected = np.zeros((most + 1, most))
    following = start / _norm(start)
    for k in range(most):
        basis[k] = following
        product = apply(following)
        if not np.isfinite(product.sum()):
            return None
        for _ in range(2):  # once more against rounding
            shares = _products(basis[: k + 1], product)
            projected[: k + 1, k] += shares
            product = product - _combined(shares, basis[: k + 1])
        rest = projected[k + 1, k] = _norm(product)
        values, vectors = np.linalg.eig(projected[: k + 1, : k + 1])
        top = int(np.argmax(values.real))
        # Of a complex pair the real part spans what both have in common with the start.
        ritz = vectors[:, top]
        estimate = float(values[top].real)
        bound = estimate + rest * float(np.abs(ritz[-1]))
        is_exact = k + 1 == len(start) or rest <= 1e-10 * abs(estimate)
        if is_exact or k + 1 == most or (k + 1 >= least and bound - estimate <= gap * bound):
            break
        following = product / rest
    vector = _combined(ritz.real, basis[: k + 1])
    size = _norm(vector)
    return SpectralBound(estimate, bound, vector / size if size > 0.0 else start)


# Not by BLAS: its threads cost more than a sum over so few rows, and its bits depend on them.
def _products(rows: Array, vector: Array) -> Array:
    return np.array([np.einsum("i,i->", row, vector) for row in rows])


def _combined(shares: Array, rows: Array) -> Array:
    total = np.zeros(rows.shape[1])
    for share, row in zip(shares, rows, strict=True):
        total += share * row
    return total


def _norm(vector: Array) -> float:
    return float(np.sqrt(np.einsum("i,i->", vector, vector)))
