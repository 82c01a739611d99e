"""Equal rows of pairs are found, and give what each by itself would."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.maths.arrays import Array
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph_builtin.gradients._equal_rows import by_distinct_rows, distinct_rows
from solidsph_builtin.gradients.cubic import Cubic

SPACING = 0.1
REACH = 2.6 * SPACING


def lattice(n: int, d: int) -> Array:
    """Positions of n^d particles."""
    axes = np.meshgrid(*[SPACING * np.arange(n)] * d, indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, d)


def kernel_gradients(pairs: Pairs) -> Array:
    close = np.maximum(1.0 - pairs.distances / REACH, 0.0)
    return -pairs.offsets * close[:, None]


def volumes(X: Array) -> Array:
    """Half a cell on each face."""
    inside = np.where(np.isin(X, [X.min(), X.max()]), 0.5, 1.0)
    return inside.prod(axis=1)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_lattice_has_as_many_kinds_as_places_beside_its_surface(d: int) -> None:
    """With a reach of 2.6 spacings, 3 on either side, by their volume too, and the inside."""
    X = lattice(9, d)
    pairs = neighbour_pairs(X, REACH)
    first, kinds = distinct_rows(pairs, volumes(X))
    assert len(first) == 7**d
    # Offsets of neighbours are those of the first of a kind, but for rounding.
    for p in range(0, len(X), 7):
        own, other = pairs.stretch(p, p + 1), pairs.stretch(first[kinds[p]], first[kinds[p]] + 1)
        np.testing.assert_allclose(own.offsets, other.offsets, atol=1e-12 * SPACING)


def test_a_volume_alone_makes_a_kind() -> None:
    X = lattice(15, 1)
    pairs, V = neighbour_pairs(X, REACH), np.ones(15)
    kinds_before = len(distinct_rows(pairs, V)[0])
    V[7] = 1.1
    # The row of the particle and those of its four neighbours.
    assert len(distinct_rows(pairs, V)[0]) == kinds_before + 5


@pytest.mark.parametrize("disorder", [0.0, 1e-6, 0.2])
def test_weights_are_those_of_each_row_by_itself(disorder: float) -> None:
    """Disorder far below what anyone sees is still no equality."""
    X = lattice(10, 2)
    X = X + disorder * SPACING * np.random.default_rng(1).uniform(-1.0, 1.0, X.shape)
    pairs, V = neighbour_pairs(X, REACH), volumes(lattice(10, 2))
    slopes = kernel_gradients(pairs)
    weights = Cubic().weights(pairs, slopes, V)
    for p in range(pairs.row_count):
        own = slice(pairs.starts[p], pairs.starts[p + 1])
        alone = Cubic().weights(pairs.stretch(p, p + 1), slopes[own], V)
        np.testing.assert_allclose(weights[own], alone, rtol=0.0, atol=1e-12 / SPACING)


def test_rows_without_an_equal_are_all_computed() -> None:
    X = np.random.default_rng(2).uniform(0.0, 1.0, (60, 2))
    pairs = neighbour_pairs(X, 0.4)
    seen: list[int] = []

    def compute(part: Pairs, slopes: Array, cells: Array) -> Array:
        seen.append(part.row_count)
        return slopes

    slopes = kernel_gradients(pairs)
    found = by_distinct_rows(pairs, slopes, np.ones(60), compute)
    assert seen == [60]
    np.testing.assert_array_equal(found, slopes)
