"""Conjugate gradients with a preconditioner, for a matrix that is known by its products."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class Solution:
    """Where an iteration ended."""

    values: Array  # (k,)
    left: float  # norm of what is left of the wanted, over its own [-]
    falls: bool  # True if it met values whose product does not oppose them: it ended there


def conjugate_gradients(
    product: Callable[[Array], Array],
    preconditioned: Callable[[Array], Array],
    wanted: Array,
    tolerance: float,
    most: int,
) -> Solution:
    """The values (k,) whose product is `wanted` (k,).

    Nocedal & Wright (2006), Numerical Optimization, algorithm 5.3. Products of vectors are formed
    without a threaded library, whose threads wait for each other where processors are shared.

    Args:
        product: of a symmetric matrix with a vector.
        preconditioned: of a positive definite matrix, near the inverse, with a vector.
        wanted: right-hand side.
        tolerance: norm of what may be left, over that of `wanted` [-].
        most: iterations.
    """
    x, r = np.zeros_like(wanted), wanted.copy()
    largest = left = _dot(r, r)
    if left == 0.0:
        return Solution(x, 0.0, falls=False)
    z = preconditioned(r)
    p, along = z.copy(), _dot(r, z)
    for _ in range(most):
        if left <= tolerance**2 * largest:
            break
        gained = product(p)
        rise = _dot(p, gained)
        if rise <= 0.0:
            return Solution(x, float(np.sqrt(left / largest)), falls=True)
        x += along / rise * p
        r -= along / rise * gained
        left = _dot(r, r)
        z = preconditioned(r)
        before, along = along, _dot(r, z)
        p *= along / before
        p += z
    return Solution(x, float(np.sqrt(left / largest)), falls=False)


def _dot(a: Array, b: Array) -> float:
    return float(np.einsum("i,i->", a, b))
