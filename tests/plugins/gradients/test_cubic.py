"""The cubic gradient beside a surface: what its particles determine of the third degree."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph_builtin.gradients._local_fits import LocalFits
from solidsph_builtin.gradients.cubic import Cubic
from solidsph_builtin.gradients.quadratic import Quadratic

COVER = 2.6


def half_space(dimension: int, seed: int | None = None) -> Array:
    """Lattice points around the first, at the origin, which is on the face X = 0; in disorder
    with a `seed`."""
    axes = [np.arange(4.0), *[np.arange(-3.0, 4.0)] * (dimension - 1)]
    X = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    X = X[np.argsort(np.linalg.norm(X, axis=1), kind="stable")]
    if seed is not None:
        X[1:] += np.random.default_rng(seed).uniform(-0.2, 0.2, X[1:].shape)
    return X


def kernel(X: Array) -> tuple[Pairs, Array]:
    """Pairs of the first particle alone, and slopes of a smooth kernel."""
    pairs = neighbour_pairs(X, COVER).stretch(0, 1)
    return pairs, pairs.offsets * (1.0 - pairs.distances / COVER)[:, None] ** 2


def slope(gradient: Cubic | Quadratic, X: Array, values: Array) -> Array:
    """Of `values` (n,) at the first of the particles, (d,)."""
    pairs, slopes = kernel(X)
    weights = gradient.weights(pairs, slopes, np.ones(len(X)))
    found: Array = weights.T @ (values[pairs.columns] - values[0])
    return found


@pytest.mark.parametrize("dimension", [2, 3])
def test_along_a_face_cubic_terms_count(dimension: int) -> None:
    X = half_space(dimension)
    cube = X[:, -1] ** 3
    assert abs(slope(Cubic(), X, cube)[-1]) < 0.5 * abs(slope(Quadratic(), X, cube)[-1])
    # Across it three layers tell no more than a parabola: of x^3 through 0, 1 and 8, -2.
    assert slope(Cubic(), X, X[:, 0] ** 3)[0] == pytest.approx(-2.0, abs=0.2)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", [1, 2])
def test_quadratic_fields_are_exact_at_a_face(dimension: int, seed: int) -> None:
    X = half_space(dimension, seed)
    f = 1.0 + X[:, 0] - 2.0 * X[:, 1] + X[:, 0] * X[:, 1] - 0.5 * X[:, 1] ** 2 + X[:, -1] ** 2
    exact = np.zeros(dimension)
    exact[:2] = 1.0, -2.0
    # Rounding, amplified by condition numbers of 1e3.
    assert np.abs(slope(Cubic(), X, f) - exact).max() < 1e-11


@pytest.mark.parametrize("dimension", [2, 3])
def test_cubic_terms_are_held_alike_in_all_directions(dimension: int) -> None:
    X = half_space(dimension, seed=3)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(dimension, dimension)))[0]

    def weights(places: Array) -> Array:
        pairs, slopes = kernel(places)
        fits = LocalFits.of_gradient(pairs, slopes, np.ones(len(places)), 3)
        return fits.with_small_cubes(0.5).gradients()[0]

    assert np.abs(weights(X @ turn.T) - weights(X) @ turn.T).max() < 1e-11
