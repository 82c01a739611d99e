"""Pairs of particles with radii of their own, against all pairs one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.model.neighbours import neighbour_pairs
from solidsph.model.pair_search import PairSearch


def scattered(d: int, seed: int, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, d) and radii (n,) that differ by up to a ratio."""
    rng = np.random.default_rng(seed)
    return rng.uniform(size=(120, d)), 0.05 * ratio ** rng.uniform(size=120)


@given(st.integers(1, 3), st.integers(0, 1000), st.floats(1.0, 16.0))
def test_pairs_are_those_closer_than_the_mean_of_their_radii(
    d: int, seed: int, ratio: float
) -> None:
    X, radii = scattered(d, seed, ratio)
    pairs = neighbour_pairs(X, radii)
    apart = np.linalg.norm(X[None] - X[:, None], axis=2)
    expected = np.argwhere(apart <= 0.5 * (radii[None] + radii[:, None]))
    assert np.array_equal(np.column_stack([pairs.rows, pairs.columns]), expected)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_equal_radii_give_the_same_pairs_as_one(d: int) -> None:
    X, _ = scattered(d, 1, 1.0)
    several, one = neighbour_pairs(X, np.full(len(X), 0.2)), neighbour_pairs(X, 0.2)
    for name in ("starts", "rows", "columns", "offsets", "distances"):
        assert np.array_equal(getattr(several, name), getattr(one, name))


def test_rows_are_found_in_the_order_in_which_they_are_asked_for() -> None:
    X, radii = scattered(2, 3, 8.0)
    rows = np.array([7, 3, 50])
    places, columns = PairSearch.of(X, radii).near(rows)
    pairs = neighbour_pairs(X, radii)
    for place, row in enumerate(rows):
        own = slice(pairs.starts[row], pairs.starts[row + 1])
        assert np.array_equal(columns[places == place], pairs.columns[own])
