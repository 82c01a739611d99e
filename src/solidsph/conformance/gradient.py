"""Checks of a gradient, on scattered particles with free surfaces all round."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import attrs
import numpy as np

from solidsph.conformance.check import Kit, Verdict, at_most, more_than, worst
from solidsph.conformance.samples import CELLS, SPACING, bodies, weights_problem
from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs

_COVER = 3.5  # in spacings: a particle in a corner has neighbours for second derivatives

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


def _weighted(gradient: Gradient, size: float = 1.0) -> Iterator[_Weighted]:
    for body in bodies(_COVER, size):
        X, unit = body.positions, max(CELLS[body.positions.shape[1]]) * SPACING * size
        weights = gradient.weights(body.pairs, body.kernel_gradients, body.volumes)
        yield _Weighted((X - X.mean(axis=0)) / unit, body.pairs, weights * unit)


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
        yield weights_problem(body.weights, body.pairs)


@KIT.problems("untouched")
def leaves_its_input(gradient: Gradient) -> Iterator[str]:
    """Kernel gradients and volumes are not changed in place, and give the same weights again."""
    for body in bodies(_COVER):
        given = body.pairs, body.kernel_gradients.copy(), body.volumes.copy()
        first = gradient.weights(*given)
        if not all(map(np.array_equal, given[1:], (body.kernel_gradients, body.volumes))):
            yield "they were changed in place"
        if not np.array_equal(first, gradient.weights(*given)):
            yield "the same input gave other weights"


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
