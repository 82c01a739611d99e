"""Checks of a gradient, on scattered particles with free surfaces all round."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import attrs
import numpy as np

from solidsph.conformance.check import Kit, Verdict, at_most, more_than, worst
from solidsph.conformance.samples import scattered, seeded
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.registry.construct import construct

_CELLS = {1: (20,), 2: (9, 8), 3: (6, 5, 5)}
_SPACING = 0.05  # [m]
_COVER = 3.5  # in spacings: a particle in a corner has neighbours for second derivatives
_KERNEL = "modified-mollifier"  # that of a scene which names none

# Relative to the sum of |g_pq| |f_q|, what rounding can do to the sum, times the loss of a few
# digits where a gradient solves a small linear system at every particle.
_EXACT = 1e-12

# Relative to the same: a gradient that is not exact misses by the order of the spacing over the
# size of the body, or of its square; far above rounding.
_INEXACT = 1e-6

KIT = Kit()


@attrs.frozen(eq=False)
class _Weighted:
    """Particles with the weights of the gradient."""

    positions: Array  # (n, d), 0 in the middle, in units of the longest side
    pairs: Pairs
    weights: Array  # (m, d)

    def worst_error(self, degree: int) -> float:
        """Largest error over the monomials of a degree, relative to what rounding can do."""
        errors = []
        for powers in _powers(self.positions.shape[1], degree):
            f = np.prod(self.positions**powers, axis=1)
            terms = self.weights * f[self.pairs.columns, None]
            wrong = self.pairs.row_sums(terms) - _exact(self.positions, powers)
            errors.append(np.abs(wrong).max() / self.pairs.row_sums(np.abs(terms)).max())
        return float(max(errors))


def _bodies(size: float = 1.0) -> Iterator[tuple[Array, Pairs, Array, Array]]:
    """Positions (n, d), pairs, kernel gradients (m, d) and volumes (n,) in 1, 2 and 3D, with every
    length multiplied by `size`."""
    for d, rng in seeded():
        X = size * scattered(rng, _CELLS[d], _SPACING)
        radius = _COVER * _SPACING * size
        pairs = neighbour_pairs(X, radius)
        volumes = (_SPACING * size) ** d * rng.uniform(0.9, 1.1, len(X))
        W = smoothing_kernel(construct("kernels", _KERNEL), d, radius)
        yield X, pairs, W.gradient(pairs.offsets, pairs.distances), volumes


def _weighted(gradient: Gradient, size: float = 1.0) -> Iterator[_Weighted]:
    for X, pairs, slopes, volumes in _bodies(size):
        unit = max(_CELLS[X.shape[1]]) * _SPACING * size
        weights = gradient.weights(pairs, slopes, volumes)
        yield _Weighted((X - X.mean(axis=0)) / unit, pairs, weights * unit)


@KIT.check
def exact_degree(gradient: Gradient) -> Verdict:
    """Polynomials up to the declared degree have exact gradients, at free surfaces too."""
    declared = gradient.exact_degree
    if declared < 0:
        return Verdict(declared == -1, f"declares {declared}: not even a constant")
    return worst(
        [
            at_most(max(body.worst_error(k) for k in range(declared + 1)), _EXACT)
            for body in _weighted(gradient)
        ]
    )


@KIT.check
def no_higher_degree(gradient: Gradient) -> Verdict:
    """Polynomials of the next degree do not: the declared degree is not too low."""
    return worst(
        [
            more_than(body.worst_error(gradient.exact_degree + 1), _INEXACT)
            for body in _weighted(gradient)
        ]
    )


@KIT.errors(_EXACT)
def inverse_length(gradient: Gradient) -> Iterator[float]:
    """Weights scale as 1 / length: twice as large a body has half the gradient."""
    # Weights come in units of 1 / size, so they must be the same; 2 is exact in binary.
    for small, large in zip(_weighted(gradient), _weighted(gradient, 2.0), strict=True):
        yield float(np.abs(small.weights - large.weights).max() / np.abs(small.weights).max())


@KIT.problems("(m, d), finite")
def shape(gradient: Gradient) -> Iterator[str]:
    """There is one finite weight vector for every pair."""
    for body in _weighted(gradient):
        expected = body.pairs.offsets.shape
        if body.weights.shape != expected or not np.all(np.isfinite(body.weights)):
            yield f"weights {body.weights.shape}, pairs {expected}, or not finite"


@KIT.problems("untouched")
def leaves_its_input(gradient: Gradient) -> Iterator[str]:
    """Kernel gradients and volumes are not changed in place, and give the same weights again."""
    for X, pairs, slopes, volumes in _bodies():
        d = X.shape[1]
        before = slopes.copy(), volumes.copy()
        first = gradient.weights(pairs, slopes, volumes)
        if not (np.array_equal(before[0], slopes) and np.array_equal(before[1], volumes)):
            yield f"{d}D: they were changed in place"
        if not np.array_equal(first, gradient.weights(pairs, slopes, volumes)):
            yield f"{d}D: the same input gave other weights"


def _powers(dimension: int, degree: int) -> list[tuple[int, ...]]:
    return [p for p in product(range(degree + 1), repeat=dimension) if sum(p) == degree]


def _exact(x: Array, powers: tuple[int, ...]) -> Array:
    """Gradient of the monomial x^powers, (n, d)."""
    columns = []
    for axis, power in enumerate(powers):
        lowered = np.array(powers)
        lowered[axis] = max(power - 1, 0)
        columns.append(power * np.prod(x**lowered, axis=1))
    return np.stack(columns, axis=1)
