"""Fits of linear or quadratic functions to the neighbours of each of many particles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product
from math import factorial, prod
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.model.neighbours import Pairs

# Pairs treated at once: what there is of them then stays in the cache of a core.
_PAIRS_AT_ONCE = 15_000

# Added to the moments, relative to their trace, so that they have an inverse. If this changes the
# fit by more than the second, the neighbours do not determine it.
_RIDGE = 1e-13
_DETERMINED = 1e-6

# Eigenvalues of a moment matrix below this part of the largest belong to functions that the
# neighbours do not determine.
_DEPENDENT = 1e-10
_SMALLEST = 1e-300


@final
@attrs.frozen(eq=False)
class LocalFits:
    """Weighted sums of products of b, the components of X_q - X_p and their products.

    Rows are filled up with zeros to the length M of the longest, so that sums over neighbours are
    products of stacked small matrices.
    """

    pairs: Pairs
    filled: Mask  # (n, M) where there is a pair
    units: Array  # (n,) of the offsets in b: the distance of the farthest neighbour [m]
    basis: Array  # (n, k, M) b
    weights: Array  # (n, 1, M) w
    moments: Array  # (n, k, k) sums of w b (x) b

    @classmethod
    def of(cls, pairs: Pairs, weights: Array, degree: int) -> LocalFits:
        """Fits of polynomials up to a `degree`; `weights` are w of all pairs (m,)."""
        counts = np.diff(pairs.starts)
        filled = np.arange(counts.max()) < counts[:, None]
        reach = np.maximum.reduceat(pairs.distances, pairs.starts[:-1])
        units = np.where(reach > 0.0, reach, 1.0)
        d = pairs.offsets.shape[1]
        factors = factors_of(d, degree)
        basis = np.zeros((len(filled), d + len(factors), filled.shape[1]))
        basis.transpose(0, 2, 1)[:, :, :d][filled] = pairs.offsets / pairs.spread(units)[:, None]
        for k, (i, j) in enumerate(factors, start=d):
            np.multiply(basis[:, i], basis[:, j], out=basis[:, k])
        padded = np.zeros((len(filled), 1, filled.shape[1]))
        padded[:, 0][filled] = weights
        moments = (padded * basis) @ basis.transpose(0, 2, 1)
        return cls(pairs, filled, units, basis, padded, moments)

    @classmethod
    def of_gradient(
        cls, pairs: Pairs, kernel_gradients: Array, cells: Array, degree: int
    ) -> LocalFits:
        """With the weights -W'(r) / r times the volume, of which the `corrected` gradient is the
        linear fit; `kernel_gradients` are those of all pairs (m, d), `cells` of the body (n,)."""
        close = closeness(kernel_gradients, pairs.distances)
        return cls.of(pairs, close * cells[pairs.columns], degree)

    def of_degree(self, degree: int) -> LocalFits:
        """Fits of polynomials up to a lower degree."""
        d = self.pairs.offsets.shape[1]
        k = d + len(factors_of(d, degree))
        return attrs.evolve(self, basis=self.basis[:, :k], moments=self.moments[:, :k, :k])

    def with_small_cubes(self, penalty: float) -> LocalFits:
        """Fits up to the third degree whose cubic terms are held small, alike in all directions.

        `penalty` is that of a cubic coefficient, relative to the mean moment of the cubic terms.
        What the neighbours determine well stays nearly what it was, and the rest nearly vanishes.
        """
        d = self.pairs.offsets.shape[1]
        factors = factors_of(d, 3)
        powers = [tuple(map(int, row)) for row in np.eye(d)]
        for i, j in factors:
            powers.append(tuple(a + b for a, b in zip(powers[i], powers[j], strict=True)))
        # How often each appears in the tensor x (x) x (x) x, whose norm is that of no direction.
        times = np.array([6.0 / prod(map(factorial, p)) * (sum(p) == 3) for p in powers])
        cubic = times > 0.0
        mean = np.einsum("nii,i->n", self.moments, times) / cubic.sum()
        held = np.where(cubic, penalty / np.where(cubic, times, 1.0), 0.0)
        extra = mean[:, None, None] * np.diag(held)
        return attrs.evolve(self, moments=self.moments + extra)

    def gradients(self) -> tuple[Array, Array]:
        """Weights of the gradient of the fit at p, (m, d) [1/m], and how they amplify noise, (n,).

        That is the sum of the lengths of a row's weights, times the distance of the farthest
        neighbour; infinite where the neighbours do not determine the fit.
        """
        moments, d, k = self.moments, self.pairs.offsets.shape[1], self.basis.shape[1]
        ridge = _RIDGE * np.einsum("nii->n", moments) + _SMALLEST
        inverse = np.linalg.inv(moments + ridge[:, None, None] * np.eye(k))
        missing = np.eye(k)[:d] - inverse[:, :d] @ moments
        # One step of refinement: the error of the inverse would show as stress in a rotation.
        slopes = inverse[:, :d] + missing @ inverse
        padded = self.weights * (slopes @ self.basis)
        noise = np.sqrt(np.einsum("nim,nim->nm", padded, padded)).sum(axis=1)
        determined = np.abs(missing).max(axis=(1, 2)) < _DETERMINED
        weights = self.of_pairs(padded / self.units[:, None, None])
        return weights, np.where(determined, noise, np.inf)

    def inverse_root(self) -> Array:
        """R (n, k, k), R R^T the inverse of the moments, 0 for functions without a meaning here."""
        sizes, directions = np.linalg.eigh(self.moments)
        known = sizes > _DEPENDENT * np.maximum(sizes[:, -1:], _SMALLEST)
        scales = np.where(known, 1.0 / np.sqrt(np.where(known, sizes, 1.0)), 0.0)
        root: Array = directions * scales[:, None, :]
        return root

    def of_pairs(self, padded: Array) -> Array:
        """Values (n, c, M) without what was filled up, (m, c)."""
        values: Array = padded.transpose(0, 2, 1)[self.filled]
        return values

    def padded(self, values: Array) -> Array:
        """Values of pairs (m, c), filled up, (n, c, M)."""
        result = np.zeros((len(self.filled), values.shape[1], self.filled.shape[1]))
        result.transpose(0, 2, 1)[self.filled] = values
        return result

    def sums(self, values: Array) -> Array:
        """Sums of w values (n, c, M) (x) b, (n, c, k)."""
        result: Array = (self.weights * values) @ self.basis.transpose(0, 2, 1)
        return result


@cache
def factors_of(dimension: int, degree: int) -> Sequence[tuple[int, int]]:
    """The two earlier functions whose product each function beyond the components is."""
    powers = [tuple(map(int, row)) for row in np.eye(dimension)]
    factors: list[tuple[int, int]] = []
    last = range(dimension)
    for _ in range(degree - 1):
        first = len(powers)
        for i, j in product(range(dimension), last):
            power = tuple(a + b for a, b in zip(powers[i], powers[j], strict=True))
            if power not in powers:
                powers.append(power)
                factors.append((i, j))
        last = range(first, len(powers))
    return factors


def portions(pairs: Pairs) -> Iterator[tuple[slice, Pairs]]:
    """A limited number of pairs at a time: where they are among all, and the rows of these."""
    first = 0
    while first < pairs.row_count:
        last = int(np.searchsorted(pairs.starts, pairs.starts[first] + _PAIRS_AT_ONCE, "right"))
        stop = min(max(first + 1, last - 1), pairs.row_count)
        own = slice(pairs.starts[first], pairs.starts[stop])
        yield own, pairs.stretch(first, stop)
        first = stop


def closeness(kernel_gradients: Array, distances: Array) -> Array:
    """-W'(r) / r of every pair, (m,); 0 for self pairs, whose offset is zero."""
    safe = np.where(distances > 0.0, distances, 1.0)
    slopes = np.sqrt(np.einsum("mi,mi->m", kernel_gradients, kernel_gradients))
    return np.where(distances > 0.0, slopes / safe, 0.0)
