"""The lowest modes of a large stiffness, by an iteration that needs its products only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solidsph.maths.arrays import Array
from solidsph.statics.linearised import UnsolvedError

# Modes that are iterated beside those wanted, so that the last of these converges as fast.
_MORE = 4

# Error of a square by the estimate below, relative to it [-].
_LEFT = 1e-11

_MOST = 500  # iterations


def lowest_modes(
    product: Callable[[Array], Array],
    preconditioned: Callable[[Array], Array],
    masses: Array,
    count: int,
) -> tuple[Array, Array]:
    """The lowest squares of frequencies (count,), ascending, and their modes (k, count).

    Conjugate gradients of all modes at once (Knyazev 2001, Toward the optimal preconditioned
    eigensolver), with an orthonormal basis (Hetmaniuk & Lehoucq 2006, Basis selection in LOBPCG).

    Args:
        product: of a positive definite stiffness with motions (k,) [N/m].
        preconditioned: about its inverse.
        masses: of the free displacements, (k,) [kg].
        count: number of modes.

    Raises:
        UnsolvedError: they do not converge.
    """
    roots = np.sqrt(masses)

    # The stiffness is scaled by the roots of the masses, so that the modes are orthonormal.
    def stiffness(motions: Array) -> Array:
        return np.column_stack([product(x / roots) / roots for x in motions.T])

    def inverse(forces: Array) -> Array:
        return np.column_stack([preconditioned(x * roots) * roots for x in forces.T])

    size = count + _MORE
    if 3 * size < len(masses):
        # A reproducible start without the symmetries of the body, smooth as the lowest modes are.
        start = np.random.default_rng(0).standard_normal((len(masses), size))
        basis = np.linalg.qr(inverse(start))[0]
    else:
        size, basis = len(masses), np.eye(len(masses))
    of_basis = stiffness(basis)
    error = np.inf
    for _ in range(_MOST):
        squares, mixed = np.linalg.eigh(basis.T @ of_basis)
        # The modes, and the directions in which they have changed, as sums of the basis.
        modes, changes = mixed[:, :size], mixed[:, :size].copy()
        changes[:size] = 0.0
        both = np.linalg.qr(np.hstack([modes, changes]))[0] if len(mixed) > size else modes
        both[:, :size] = modes
        basis, of_basis = basis @ both, of_basis @ both
        left = of_basis[:, :size] - basis[:, :size] * squares[:size]
        steps = inverse(left)
        # With the exact inverse, that of the energy that a mode is off by.
        errors = np.einsum("ki,ki->i", left, steps)[:count] / squares[:count]
        error = float(errors.max())
        if error <= _LEFT:
            return squares[:count], basis[:, :count] / roots[:, None]
        steps /= np.linalg.norm(steps, axis=0)
        for _ in range(2):  # once more, for what rounding leaves
            steps = np.linalg.qr(steps - basis @ (basis.T @ steps))[0]
        basis = np.hstack([basis, steps])
        of_basis = np.hstack([of_basis, stiffness(steps)])
    raise UnsolvedError(error, _MOST)
