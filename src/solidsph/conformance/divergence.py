"""Checks of a divergence, with a gradient that is exact for linear fields."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from solidsph.conformance.check import Kit, Verdict, at_most, more_than
from solidsph.conformance.samples import SPACING, Body, bodies, seeded, weights_problem
from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.gradient import Gradient
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs
from solidsph.registry.construct import construct

_COVER = 2.5  # a particle in a corner has neighbours for a linear field
_INSIDE = 3  # layers: as far as the cover reaches, and one more

# Products and sums of some hundred terms.
_ROUNDING = 1e-12

# Error in a property that a divergence does not have: beside a surface of the order of the terms
# themselves, everywhere far above rounding.
_ABSENT = 1e-6

KIT = Kit()


@attrs.frozen(eq=False)
class _Weighted:
    """Particles with the weights of a gradient and of the divergence."""

    positions: Array  # (n, d)
    pairs: Pairs
    volumes: Array  # (n,)
    gradient_weights: Array  # (m, d)
    weights: Array  # (m, d)

    @classmethod
    def of(cls, divergence: Divergence, body: Body) -> _Weighted:
        gradient: Gradient = construct("gradients", "corrected")
        pairs, volumes = body.pairs, body.volumes
        g = gradient.weights(pairs, body.kernel_gradients, volumes)
        return cls(body.positions, pairs, volumes, g, divergence.weights(pairs, g, volumes))


def _bodies(divergence: Divergence, size: float = 1.0) -> Iterator[_Weighted]:
    for body in bodies(_COVER, size):
        yield _Weighted.of(divergence, body)


@KIT.problems("(m, d), finite")
def shape(divergence: Divergence) -> Iterator[str]:
    """There is one finite weight vector for every pair."""
    for body in _bodies(divergence):
        yield weights_problem(body.weights, body.pairs)


@KIT.errors(_ROUNDING)
def area(divergence: Divergence) -> Iterator[float]:
    """Weights scale as length^(d-1), as areas do: twice as large a body under the same stress."""
    for small, large in zip(_bodies(divergence), _bodies(divergence, 2.0), strict=True):
        expected = 2.0 ** (small.positions.shape[1] - 1) * small.weights
        yield float(np.abs(large.weights - expected).max() / np.abs(expected).max())


@KIT.errors(_ROUNDING)
def divergence_inside(divergence: Divergence) -> Iterator[float]:
    """Inside a lattice the force of a linear stress is the volume times its divergence, and a
    constant stress exerts none."""
    for d, rng in seeded():
        # The force on the particle in the middle reaches one layer less on either side.
        axis = (np.arange(4 * _INSIDE + 1) - 2 * _INSIDE) * SPACING
        X = np.stack([x.ravel() for x in np.meshgrid(*[axis] * d, indexing="ij")], axis=1)
        volumes = np.full(len(X), SPACING**d)
        body = _Weighted.of(divergence, Body.of(X, volumes, _COVER * SPACING))
        inside = np.abs(X).max(axis=1) < 0.5 * SPACING
        slope, constant = rng.normal(size=d), rng.normal()
        T = constant + X @ slope / (len(axis) * SPACING)
        terms = body.weights * T[body.pairs.columns, None]
        expected = volumes[:, None] * slope / (len(axis) * SPACING)
        error = np.abs(body.pairs.row_sums(terms) - expected)
        yield float(error[inside].max() / body.pairs.row_sums(np.abs(terms))[inside].max())


@KIT.check
def momentum(divergence: Divergence) -> Verdict:
    """The forces of a free body add up to zero whatever the stresses, if and only if declared."""
    errors = []
    for body in _bodies(divergence):
        total = np.zeros_like(body.positions)
        size = np.zeros_like(body.positions)
        np.add.at(total, body.pairs.columns, body.weights)
        np.add.at(size, body.pairs.columns, np.abs(body.weights))
        errors.append(float(np.abs(total).max() / size.max()))
    return _declared(divergence.conserves_momentum, errors)


@KIT.check
def adjoint(divergence: Divergence) -> Verdict:
    """The weights are -V_q g_qp, if and only if declared."""
    errors = []
    for body in _bodies(divergence):
        back = body.gradient_weights[body.pairs.reversed_order()]
        expected = -body.volumes[body.pairs.columns, None] * back
        errors.append(float(np.abs(body.weights - expected).max() / np.abs(expected).max()))
    return _declared(divergence.adjoint, errors)


@KIT.problems("untouched")
def leaves_its_input(divergence: Divergence) -> Iterator[str]:
    """The gradient's weights and the volumes are not changed in place."""
    for body in _bodies(divergence):
        g, V = body.gradient_weights.copy(), body.volumes.copy()
        divergence.weights(body.pairs, body.gradient_weights, body.volumes)
        same = np.array_equal(g, body.gradient_weights) and np.array_equal(V, body.volumes)
        yield "" if same else "they were changed in place"


def _declared(declared: bool, errors: list[float]) -> Verdict:
    """Passed if the property holds where it is declared, and does not where it is not."""
    return at_most(max(errors), _ROUNDING) if declared else more_than(max(errors), _ABSENT)
