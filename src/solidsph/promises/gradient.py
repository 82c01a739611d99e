"""What every gradient must keep, on scattered particles with free surfaces all round."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import attrs
import numpy as np

from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.promises.check import Check, Verdict, at_most, check, more_than, worst
from solidsph.promises.samples import scattered, seeded
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


@attrs.frozen(eq=False)
class _Weighted:
    """An arrangement with the gradient's weights on it."""

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


def _arrangements(gradient: Gradient, size: float = 1.0) -> Iterator[_Weighted]:
    """In 1, 2 and 3D, with every length multiplied by `size`."""
    for d, rng in seeded():
        X = size * scattered(rng, _CELLS[d], _SPACING)
        radius = _COVER * _SPACING * size
        pairs = neighbour_pairs(X, radius)
        volumes = (_SPACING * size) ** d * rng.uniform(0.9, 1.1, len(X))
        W = smoothing_kernel(construct("kernels", _KERNEL), d, radius)
        weights = gradient.weights(pairs, W.gradient(pairs.offsets, pairs.distances), volumes)
        unit = max(_CELLS[d]) * _SPACING * size
        yield _Weighted((X - X.mean(axis=0)) / unit, pairs, weights * unit)


@check
def exact_degree(gradient: Gradient) -> Verdict:
    """Polynomials up to the declared degree have exact gradients, at free surfaces too."""
    declared = gradient.exact_degree
    if declared < 0:
        return Verdict(declared == -1, f"declares {declared}: not even a constant")
    return worst(
        [
            at_most(max(one.worst_error(k) for k in range(declared + 1)), _EXACT)
            for one in _arrangements(gradient)
        ]
    )


@check
def no_higher_degree(gradient: Gradient) -> Verdict:
    """One degree higher they are not: the declaration is not too modest."""
    return worst(
        [
            more_than(one.worst_error(gradient.exact_degree + 1), _INEXACT)
            for one in _arrangements(gradient)
        ]
    )


@check
def inverse_length(gradient: Gradient) -> Verdict:
    """Weights scale as 1 / length: twice as large a body has half the gradient."""
    # Weights come in units of 1 / size, so they must be the same; 2 is exact in binary.
    errors = [
        float(np.abs(small.weights - large.weights).max() / np.abs(small.weights).max())
        for small, large in zip(_arrangements(gradient), _arrangements(gradient, 2.0), strict=True)
    ]
    return at_most(max(errors), _EXACT)


@check
def shape(gradient: Gradient) -> Verdict:
    """There is one finite weight vector for every pair."""
    for one in _arrangements(gradient):
        expected = one.pairs.offsets.shape
        if one.weights.shape != expected or not np.all(np.isfinite(one.weights)):
            return Verdict(False, f"weights {one.weights.shape}, pairs {expected}, or not finite")
    return Verdict(True, "(m, d), finite")


@check
def leaves_its_input(gradient: Gradient) -> Verdict:
    """Kernel gradients and volumes are left as they were, and the same ones give the same weights
    again."""
    for d, rng in seeded():
        X = scattered(rng, _CELLS[d], _SPACING)
        pairs = neighbour_pairs(X, _COVER * _SPACING)
        W = smoothing_kernel(construct("kernels", _KERNEL), d, _COVER * _SPACING)
        slopes, volumes = W.gradient(pairs.offsets, pairs.distances), np.full(len(X), _SPACING**d)
        before = slopes.copy(), volumes.copy()
        first = gradient.weights(pairs, slopes, volumes)
        if not (np.array_equal(before[0], slopes) and np.array_equal(before[1], volumes)):
            return Verdict(False, f"{d}D: they were changed in place")
        if not np.array_equal(first, gradient.weights(pairs, slopes, volumes)):
            return Verdict(False, f"{d}D: the same question got another answer")
    return Verdict(True, "untouched")


CHECKS: tuple[Check, ...] = (
    exact_degree,
    no_higher_degree,
    inverse_length,
    shape,
    leaves_its_input,
)


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
