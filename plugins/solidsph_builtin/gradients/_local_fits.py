"""Fits of linear or quadratic functions to the neighbours of each of many particles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs

# Pairs treated at once: what there is of them then stays in the cache of a core.
_PAIRS_AT_ONCE = 15_000

# Eigenvalues of a moment matrix below this part of the largest belong to functions that the
# neighbours do not determine.
_DEPENDENT = 1e-10
_SMALLEST = 1e-300


@final
@attrs.frozen(eq=False)
class LocalFits:
    """Weighted sums of products of b, the offset X_q - X_p and the products of its components.

    Rows are filled up with zeros to the length M of the longest, so that sums over neighbours are
    products of stacked small matrices.
    """

    pairs: Pairs
    filled: Mask  # (n, M) where there is a pair
    units: Array  # (n,) of the offsets in b: the distance of the farthest neighbour [m]
    basis: Array  # (n, M, k) b
    weights: Array  # (n, M, 1) w
    moments: Array  # (n, k, k) sums of w b (x) b

    @classmethod
    def of(cls, pairs: Pairs, weights: Array, degree: int) -> LocalFits:
        """Fits of functions of the first or second `degree`; `weights` are w of all pairs (m,)."""
        filled = np.arange(np.diff(pairs.starts).max()) < np.diff(pairs.starts)[:, None]
        reach = np.maximum.reduceat(pairs.distances, pairs.starts[:-1])
        units = np.where(reach > 0.0, reach, 1.0)
        scaled = pairs.offsets / pairs.spread(units)[:, None]
        d = scaled.shape[1]
        basis = np.zeros((*filled.shape, d if degree < 2 else d + d * (d + 1) // 2))
        basis[:, :, :d][filled] = scaled
        if degree > 1:
            upper = np.triu_indices(d)
            np.multiply(basis[:, :, upper[0]], basis[:, :, upper[1]], out=basis[:, :, d:])
        padded = np.zeros((*filled.shape, 1))
        padded[filled, 0] = weights
        moments = (padded * basis).transpose(0, 2, 1) @ basis
        return cls(pairs, filled, units, basis, padded, moments)

    def inverse_root(self) -> Array:
        """R (n, k, k), R R^T the inverse of the moments, 0 for functions without a meaning here."""
        sizes, directions = np.linalg.eigh(self.moments)
        known = sizes > _DEPENDENT * np.maximum(sizes[:, -1:], _SMALLEST)
        scales = np.where(known, 1.0 / np.sqrt(np.where(known, sizes, 1.0)), 0.0)
        root: Array = directions * scales[:, None, :]
        return root

    def of_pairs(self, padded: Array) -> Array:
        """Values (n, M, c) without what was filled up, (m, c)."""
        values: Array = padded[self.filled]
        return values

    def padded(self, values: Array) -> Array:
        """Values of pairs (m, c), filled up, (n, M, c)."""
        result = np.zeros((*self.filled.shape, values.shape[1]))
        result[self.filled] = values
        return result

    def sums(self, values: Array) -> Array:
        """Sums of w b (x) values (n, M, c), (n, k, c)."""
        result: Array = self.basis.transpose(0, 2, 1) @ (self.weights * values)
        return result


def portions(pairs: Pairs) -> Iterator[tuple[slice, slice, Pairs]]:
    """A limited number of pairs at a time: their rows, where they are, and the pairs."""
    first = 0
    while first < pairs.row_count:
        last = int(np.searchsorted(pairs.starts, pairs.starts[first] + _PAIRS_AT_ONCE, "right"))
        stop = min(max(first + 1, last - 1), pairs.row_count)
        own = slice(pairs.starts[first], pairs.starts[stop])
        yield slice(first, stop), own, pairs.stretch(first, stop)
        first = stop


def closeness(kernel_gradients: Array, distances: Array) -> Array:
    """-W'(r) / r of every pair, (m,); 0 for self pairs, whose offset is zero."""
    safe = np.where(distances > 0.0, distances, 1.0)
    slopes = np.sqrt(np.einsum("mi,mi->m", kernel_gradients, kernel_gradients))
    return np.where(distances > 0.0, slopes / safe, 0.0)
