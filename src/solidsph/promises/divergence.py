"""What every divergence must keep, with a gradient that is exact for linear fields."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.promises.check import Check, Verdict, at_most, check, more_than
from solidsph.promises.samples import scattered, seeded
from solidsph.registry.construct import construct

_CELLS = {1: (20,), 2: (9, 8), 3: (6, 5, 5)}
_SPACING = 0.05  # [m]
_COVER = 2.5  # a particle in a corner has neighbours for a linear field
_INSIDE = 3  # layers: as far as the cover reaches, and one more

# Products and sums of some hundred terms.
_ROUNDING = 1e-12

# What a property misses that a divergence does not have: of the order of the terms themselves
# beside a surface, far above rounding anywhere.
_ABSENT = 1e-6


@attrs.frozen(eq=False)
class _Weighted:
    """Particles with the weights of a gradient and of the divergence on them."""

    positions: Array  # (n, d)
    pairs: Pairs
    volumes: Array  # (n,)
    gradient_weights: Array  # (m, d)
    weights: Array  # (m, d)


def _weighted(divergence: Divergence, X: Array, volumes: Array, support: float) -> _Weighted:
    d = X.shape[1]
    pairs = neighbour_pairs(X, support)
    W = smoothing_kernel(construct("kernels", "modified-mollifier"), d, support)
    gradient: Gradient = construct("gradients", "corrected")
    g = gradient.weights(pairs, W.gradient(pairs.offsets, pairs.distances), volumes)
    return _Weighted(X, pairs, volumes, g, divergence.weights(pairs, g, volumes))


def _arrangements(divergence: Divergence, size: float = 1.0) -> Iterator[_Weighted]:
    """Scattered free bodies in 1, 2 and 3D, with every length multiplied by `size`."""
    for d, rng in seeded():
        h = size * _SPACING
        X = size * scattered(rng, _CELLS[d], _SPACING)
        yield _weighted(divergence, X, h**d * rng.uniform(0.9, 1.1, len(X)), _COVER * h)


@check
def shape(divergence: Divergence) -> Verdict:
    """There is one finite weight vector for every pair."""
    for one in _arrangements(divergence):
        expected = one.pairs.offsets.shape
        if one.weights.shape != expected or not np.all(np.isfinite(one.weights)):
            return Verdict(False, f"weights {one.weights.shape}, pairs {expected}, or not finite")
    return Verdict(True, "(m, d), finite")


@check
def area(divergence: Divergence) -> Verdict:
    """Weights scale as length^(d-1), as areas do: twice as large a body under the same stress."""
    errors = []
    pairs = zip(_arrangements(divergence), _arrangements(divergence, 2.0), strict=True)
    for small, large in pairs:
        expected = 2.0 ** (small.positions.shape[1] - 1) * small.weights
        errors.append(float(np.abs(large.weights - expected).max() / np.abs(expected).max()))
    return at_most(max(errors), _ROUNDING)


@check
def divergence_inside(divergence: Divergence) -> Verdict:
    """Inside a lattice the force of a linear stress is the volume times its divergence, and a
    constant stress exerts none."""
    errors = []
    for d, rng in seeded():
        # A layer more on either side than the force of a particle inside looks at.
        axis = (np.arange(4 * _INSIDE + 1) - 2 * _INSIDE) * _SPACING
        X = np.stack([x.ravel() for x in np.meshgrid(*[axis] * d, indexing="ij")], axis=1)
        volumes = np.full(len(X), _SPACING**d)
        one = _weighted(divergence, X, volumes, _COVER * _SPACING)
        inside = np.abs(X).max(axis=1) < 0.5 * _SPACING
        slope, constant = rng.normal(size=d), rng.normal()
        T = constant + X @ slope / (len(axis) * _SPACING)
        force = one.pairs.row_sums(one.weights * T[one.pairs.columns, None])
        expected = volumes[:, None] * slope / (len(axis) * _SPACING)
        scale = np.abs(one.pairs.row_sums(np.abs(one.weights * T[one.pairs.columns, None])))
        errors.append(float(np.abs(force - expected)[inside].max() / scale[inside].max()))
    return at_most(max(errors), _ROUNDING)


@check
def momentum(divergence: Divergence) -> Verdict:
    """The forces of a free body add up to zero whatever the stresses, if and only if declared."""
    errors = []
    for one in _arrangements(divergence):
        total = np.zeros_like(one.positions)
        size = np.zeros_like(one.positions)
        np.add.at(total, one.pairs.columns, one.weights)
        np.add.at(size, one.pairs.columns, np.abs(one.weights))
        errors.append(float(np.abs(total).max() / size.max()))
    if divergence.conserves_momentum:
        return at_most(max(errors), _ROUNDING)
    return more_than(max(errors), _ABSENT)


@check
def adjoint(divergence: Divergence) -> Verdict:
    """The weights are -V_q g_qp, if and only if declared."""
    errors = []
    for one in _arrangements(divergence):
        back = one.gradient_weights[one.pairs.reversed_order()]
        expected = -one.volumes[one.pairs.columns, None] * back
        errors.append(float(np.abs(one.weights - expected).max() / np.abs(expected).max()))
    if divergence.adjoint:
        return at_most(max(errors), _ROUNDING)
    return more_than(max(errors), _ABSENT)


@check
def leaves_its_input(divergence: Divergence) -> Verdict:
    """The gradient's weights and the volumes are left as they were."""
    for one in _arrangements(divergence):
        g, V = one.gradient_weights.copy(), one.volumes.copy()
        divergence.weights(one.pairs, one.gradient_weights, one.volumes)
        if not (np.array_equal(g, one.gradient_weights) and np.array_equal(V, one.volumes)):
            return Verdict(False, "they were changed in place")
    return Verdict(True, "untouched")


CHECKS: tuple[Check, ...] = (shape, area, divergence_inside, momentum, adjoint, leaves_its_input)
