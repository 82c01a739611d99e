"""Bundles of pairs, and formulas of lanes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types

from solidsph.engines.compiled.fixed.lanes import lanes_type
from solidsph.engines.compiled.pair_bundles import LANES, pair_bundles
from solidsph.engines.compiled.pointwise import (
    NotCompilableError,
    compiled_function,
    numbers_type,
)
from solidsph.engines.compiled.time_loop.pair_load import pair_arrays, pair_sweep
from solidsph.interfaces.pair_table import PairTable
from solidsph.maths.tensors import dot


def lattice_pairs(shape: tuple[int, ...], reach: float, rng: Any, jitter: float = 0.0) -> Any:
    """Positions (n, d), and the table of all pairs within reach with two values each."""
    X = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    X = X.reshape(-1, len(shape)).astype(float)
    X += jitter * rng.standard_normal(X.shape)
    R = np.linalg.norm(X[:, None] - X, axis=2)
    p, q = np.nonzero((R > 0.0) & (reach > R))
    values = np.stack([np.exp(-R[p, q]), R[p, q]], axis=1)
    return X, PairTable.of(p, q, values, len(X))


def unpacked(bundles: Any) -> dict[tuple[int, int], Any]:
    """Values of every pair; fails if one is there twice."""
    found = {}
    values = bundles.values.reshape(-1, 2)
    for group in range(len(bundles.starts) - 1):
        for m in range(bundles.starts[group], bundles.starts[group + 1]):
            offset, bits = bundles.bundles[m]
            for k in range(LANES):
                if bits >> k & 1:
                    p = LANES * group + k
                    assert (p, p + offset) not in found
                    found[p, int(p + offset)] = values[m]
    values = bundles.single_values.reshape(-1, 2)
    for (p, q), own in zip(bundles.singles.tolist(), values, strict=True):
        assert (p, q) not in found
        found[p, q] = own
    return found


@given(
    shape=st.lists(st.integers(1, 11), min_size=1, max_size=3).map(tuple),
    reach=st.floats(0.5, 3.1),
    jitter=st.sampled_from([0.0, 0.1]),
    together=st.booleans(),
)
def test_every_pair_is_there_once_with_its_values(shape, reach, jitter, together):
    _, table = lattice_pairs(shape, reach, np.random.default_rng(0), jitter)
    found = unpacked(pair_bundles(table, together=together))
    once = table.rows < table.columns
    expected = dict(
        zip(
            zip(table.rows[once].tolist(), table.columns[once].tolist(), strict=True),
            table.values[once],
            strict=True,
        )
    )
    assert found.keys() == expected.keys()
    # Values of a bundle differ by rounding of positions.
    for pair, values in expected.items():
        np.testing.assert_allclose(found[pair], values, rtol=0.0, atol=1e-12)


def test_a_lattice_has_nearly_all_its_pairs_in_bundles():
    # Lines long beside the registers of any machine: those of 6 are shorter than some.
    _, table = lattice_pairs((6, 6, 32), 2.6, np.random.default_rng(0))
    bundles = pair_bundles(table)
    assert len(bundles.singles) < 0.01 * len(table.columns)
    # Of the lanes of a bundle most have a pair.
    assert 2 * LANES * len(bundles.bundles) < 1.4 * len(table.columns)


def damped(offset, velocity, values):
    square = dot(offset, offset) + values[1]
    approach = np.minimum(dot(velocity, offset), 0.0) / np.sqrt(square)
    return values[0] * approach**2 - 2 * np.abs(approach) + np.maximum(values[1], approach) / 3.0


def swinging(offset, velocity, values):
    """Of no kind that lanes know."""
    return values[0] * np.cos(dot(offset, offset) / values[1])


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("jitter", [0.0, 0.1])
@pytest.mark.parametrize(("pull", "together"), [(damped, True), (swinging, False)])
@pytest.mark.parametrize("threads", [1, 3])
def test_forces_are_those_of_pairs_one_by_one(dimension, jitter, pull, together, threads):
    rng = np.random.default_rng(1)
    X, table = lattice_pairs((11, 7, 5)[:dimension], 2.6, rng, jitter)
    u, v = 0.1 * rng.standard_normal((2, *X.shape))
    x, p, q = X + u, table.rows, table.columns
    pulls = pull((x[q] - x[p]).T, (v[q] - v[p]).T, table.values.T)
    expected = np.zeros_like(X)
    np.add.at(expected, p, pulls[:, None] * (x[q] - x[p]))
    vector = numbers_type(dimension)
    compiled = compiled_function(pull, vector, vector, numbers_type(2))
    sweep = pair_sweep(compiled, dimension, 2, together, False)
    arrays = pair_arrays(table, X, threads, together=together)
    found = np.empty_like(X)
    for _ in range(2):  # nothing is left over from the first time
        sweep(arrays, u, v, found)
        # Sums of some tens of numbers, in another order.
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13 * np.abs(pulls).max())
    # Each pair acts on both ends by the same number.
    assert np.abs(found.sum(axis=0)).max() < 1e-13 * np.abs(found).sum()


def test_lanes_take_what_formulas_are_made_of():
    lanes = lanes_type(3, LANES)
    compiled_function(damped, lanes, lanes, numbers_type(2))
    with pytest.raises(NotCompilableError):
        compiled_function(swinging, lanes, lanes, numbers_type(2))
    with pytest.raises(NotCompilableError):
        compiled_function(lambda a, b: a[0] // b, lanes, types.float64)


def test_an_undefined_velocity_shows_in_the_forces_of_its_pairs_only():
    X, table = lattice_pairs((40,), 1.1, np.random.default_rng(0))
    vector = numbers_type(1)
    sweep = pair_sweep(
        compiled_function(damped, vector, vector, numbers_type(2)), 1, 2, True, False
    )
    v, found = np.zeros_like(X), np.empty_like(X)
    v[20] = np.nan
    sweep(pair_arrays(table, X, 1, together=True), np.zeros_like(X), v, found)
    assert np.flatnonzero(np.isnan(found[:, 0])).tolist() == [19, 20, 21]
