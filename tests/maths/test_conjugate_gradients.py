"""Conjugate gradients against a dense solution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.maths.arrays import Array
from solidsph.maths.conjugate_gradients import conjugate_gradients


def matrix(eigenvalues: Array, seed: int) -> Array:
    """A symmetric matrix with these eigenvalues."""
    random = np.random.default_rng(seed)
    vectors, _ = np.linalg.qr(random.standard_normal((len(eigenvalues), len(eigenvalues))))
    result: Array = (vectors * eigenvalues) @ vectors.T
    return result


@given(size=st.integers(1, 12), seed=st.integers(0, 99), scaled=st.booleans())
def test_the_solution_is_that_of_a_dense_solver(size: int, seed: int, scaled: bool) -> None:
    random = np.random.default_rng(seed)
    A = matrix(random.uniform(0.1, 10.0, size), seed)
    wanted = random.standard_normal(size)
    diagonal = np.diag(A) if scaled else np.ones(size)
    found = conjugate_gradients(lambda x: A @ x, lambda r: r / diagonal, wanted, 1e-10, 10 * size)
    assert not found.falls
    assert found.left <= 1e-10
    # The error is what is left times the condition of at most 100.
    assert found.values == pytest.approx(np.linalg.solve(A, wanted), abs=1e-7)


def test_it_ends_where_a_motion_falls() -> None:
    A = matrix(np.array([-1.0, 1.0, 2.0, 3.0]), 0)
    wanted = np.random.default_rng(1).standard_normal(4)
    assert conjugate_gradients(lambda x: A @ x, lambda r: r, wanted, 1e-10, 100).falls


def test_it_ends_after_the_given_number() -> None:
    A = matrix(np.linspace(1.0, 100.0, 40), 0)
    wanted = np.random.default_rng(1).standard_normal(40)
    found = conjugate_gradients(lambda x: A @ x, lambda r: r, wanted, 1e-10, 5)
    left = np.linalg.norm(wanted - A @ found.values) / np.linalg.norm(wanted)
    assert found.left == pytest.approx(left, rel=1e-8)
    assert left > 1e-10


def test_nothing_wanted_is_nothing_done() -> None:
    found = conjugate_gradients(lambda x: x, lambda r: r, np.zeros(3), 1e-10, 5)
    assert (found.values == 0.0).all()
    assert found.left == 0.0
