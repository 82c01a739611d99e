"""Factors in a band, against dense ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array, random_array

from solidsph.maths import band
from solidsph.maths.band import band_factors

N = 60


def symmetric(shift: float) -> csr_array:
    """A sparse symmetric matrix, with rows in no order, positive definite for a large shift."""
    half = random_array((N, N), density=0.03, rng=np.random.default_rng(1), format="csr")
    return csr_array(half + half.T + shift * eye_array(N, format="csr"))


@pytest.mark.parametrize("shape", [(N,), (N, 3)])
def test_solutions_are_those_of_the_dense_matrix(shape: tuple[int, ...]) -> None:
    matrix, values = symmetric(4.0), np.random.default_rng(2).standard_normal(shape)
    factors = band_factors(matrix)
    assert factors is not None
    dense = np.linalg.solve(matrix.toarray(), values)
    assert np.allclose(factors.solve(values), dense, rtol=1e-12, atol=1e-13)


def test_what_is_not_positive_has_none() -> None:
    matrix = symmetric(0.1)
    assert np.linalg.eigvalsh(matrix.toarray())[0] < 0.0
    assert band_factors(matrix) is None


@pytest.mark.parametrize("place", [(3, 40), (40, 3)])
@pytest.mark.parametrize("mirrored", [0.0, 1.0])
def test_what_is_not_symmetric_has_none(place: tuple[int, int], mirrored: float) -> None:
    """A number that has no mirror image, or another one."""
    i, j = place
    whole = symmetric(6.0).tolil()
    whole[i, j] = whole[j, i] = 2.0
    assert band_factors(csr_array(whole)) is not None
    whole[j, i] = mirrored
    assert band_factors(csr_array(whole)) is None


def test_rounding_that_stands_alone_is_left_out() -> None:
    """Sums that cancel on one side of the diagonal only are not stored there."""
    whole = symmetric(6.0).tolil()
    whole[3, 40] = 1e-16
    assert band_factors(csr_array(whole)) is not None


def test_a_band_that_would_fill_the_memory_is_left_to_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(band, "MOST_IN_BAND", 100)
    assert band_factors(symmetric(4.0)) is None
