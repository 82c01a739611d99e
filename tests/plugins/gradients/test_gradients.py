"""Gradients: the conformance kit for every one that is installed, and what single ones claim."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.errors import BuildError
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.registry import registry
from solidsph.testing import Check, checks, example_part


@pytest.mark.parametrize("name", registry.names("gradients"))
@pytest.mark.parametrize("check", checks("gradients"), ids=lambda check: check.__name__)
def test_conformance(name: str, check: Check) -> None:
    result = check(example_part("gradients", name))
    assert result.passed, result


def gradient_weights(name: str, X: Array, radius: float) -> tuple[Pairs, Array]:
    pairs = neighbour_pairs(X, radius)
    W = smoothing_kernel(example_part("kernels", "cubic-spline"), X.shape[1], radius)
    slopes = W.gradient(pairs.offsets, pairs.distances)
    return pairs, example_part("gradients", name).weights(pairs, slopes, np.full(len(X), 0.01))


def lattice(count: int) -> Array:
    axis = 0.1 * np.arange(count)
    return np.stack([grid.ravel() for grid in np.meshgrid(axis, axis)], axis=1)


def test_difference_is_the_standard_gradient_where_supports_are_complete() -> None:
    X = lattice(12)
    pairs, standard = gradient_weights("standard", X, 0.25)
    _, difference = gradient_weights("difference", X, 0.25)
    inner = np.all((X > 0.25) & (X < 1.1 - 0.25), axis=1)[pairs.rows]
    scale = np.abs(standard).max()
    # Sums over 20 neighbours that cancel by symmetry; elsewhere they do not.
    assert np.abs(difference - standard)[inner].max() < 1e-14 * scale
    assert np.abs(difference - standard)[~inner].max() > 0.1 * scale


def test_corrected_refuses_neighbours_on_a_line_and_names_the_remedy() -> None:
    line = np.stack([0.1 * np.arange(8), np.zeros(8)], axis=1)
    with pytest.raises(BuildError, match=r"do not span 2 dimensions.*larger cover"):
        gradient_weights("corrected", line, 0.25)
