"""Tensor words against numpy.linalg, for arrays of points and for tuples of numbers alike."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.maths import tensors
from solidsph.maths.arrays import Array, Scalar, Tensor
from solidsph.testing.strategies import deformation_gradients, dimensions
from tests.helpers.examples import examples

# A handful of products and sums of numbers of order 1.
ROUNDING = 1e-13


def symmetric(A: Array) -> Array:
    return 0.5 * (A + A.T)


UNARY: dict[str, tuple[Callable[[Tensor], Tensor | Scalar], Callable[[Array], Array]]] = {
    "identity": (tensors.identity, lambda A: np.eye(len(A))),
    "trace": (tensors.trace, lambda A: np.asarray(np.trace(A))),
    "determinant": (tensors.determinant, lambda A: np.asarray(np.linalg.det(A))),
    "cofactor": (tensors.cofactor, lambda A: np.linalg.det(A) * np.linalg.inv(A).T),
    "transpose": (tensors.transpose, lambda A: A.T),
    "inverse": (tensors.inverse, np.linalg.inv),
    "inverse_transpose": (tensors.inverse_transpose, lambda A: np.linalg.inv(A).T),
    "right_cauchy_green": (tensors.right_cauchy_green, lambda A: A.T @ A),
    "green_lagrange": (tensors.green_lagrange, lambda A: 0.5 * (A.T @ A - np.eye(len(A)))),
    "small_strain": (tensors.small_strain, lambda A: symmetric(A) - np.eye(len(A))),
    "scale": (lambda A: tensors.scale(2.5, A), lambda A: 2.5 * A),
}

BINARY: dict[
    str, tuple[Callable[[Tensor, Tensor], Tensor | Scalar], Callable[[Array, Array], Array]]
] = {
    "add": (tensors.add, np.add),
    "product": (tensors.product, np.matmul),
    "contraction": (tensors.contraction, lambda A, B: np.asarray(np.sum(A * B))),
    "cauchy_stress": (tensors.cauchy_stress, lambda F, P: P @ F.T / np.linalg.det(F)),
}


def tuples(A: Array) -> Tensor:
    return tuple(tuple(float(a) for a in row) for row in A)


def at_point(result: Tensor | Scalar, point: int) -> Array:
    """One point of a result for arrays, whose constant components may be plain numbers."""
    if isinstance(result, tuple):
        return np.array([[np.broadcast_to(c, (2,))[point] for c in row] for row in result])
    return np.asarray(np.broadcast_to(result, (2,))[point])


@pytest.mark.parametrize("word", UNARY)
@given(data=st.data(), dimension=dimensions())
@examples(30)
def test_words_of_one_tensor(word: str, data: st.DataObject, dimension: int) -> None:
    ours, theirs = UNARY[word]
    A, B = (data.draw(deformation_gradients(dimension)) for _ in range(2))
    together = ours(np.stack([A, B], axis=-1))
    for point, one in enumerate((A, B)):
        assert np.abs(np.array(ours(tuples(one))) - theirs(one)).max() < ROUNDING
        np.testing.assert_array_equal(np.array(ours(tuples(one))), at_point(together, point))


@pytest.mark.parametrize("word", BINARY)
@given(data=st.data(), dimension=dimensions())
@examples(30)
def test_words_of_two_tensors(word: str, data: st.DataObject, dimension: int) -> None:
    ours, theirs = BINARY[word]
    A, B = (data.draw(deformation_gradients(dimension)) for _ in range(2))
    together = ours(np.stack([A, B], axis=-1), np.stack([B, A], axis=-1))
    for point, (one, other) in enumerate(((A, B), (B, A))):
        alone = np.array(ours(tuples(one), tuples(other)))
        assert np.abs(alone - theirs(one, other)).max() < ROUNDING
        np.testing.assert_array_equal(alone, at_point(together, point))


@given(data=st.data(), dimension=dimensions())
@examples(50)
def test_push_forward(data: st.DataObject, dimension: int) -> None:
    F = data.draw(deformation_gradients(dimension))
    S = symmetric(data.draw(deformation_gradients(dimension)))
    J = np.linalg.det(F)
    sigma = np.array(tensors.cauchy_stress(F, tensors.product(F, S)))
    # From the second Piola-Kirchhoff stress, sigma = F S F^T / J, symmetric as S is.
    assert np.abs(sigma - F @ S @ F.T / J).max() < ROUNDING
    assert np.abs(sigma - sigma.T).max() < ROUNDING
    # Back again, P = J sigma F^-T.
    P = tensors.scale(J, tensors.product(tuples(sigma), tensors.inverse_transpose(F)))
    assert np.abs(np.array(P) - F @ S).max() < ROUNDING
    # Nanson: a force is the same on the reference and on the current area, P N = sigma cof(F) N.
    assert np.abs(sigma @ np.array(tensors.cofactor(F)) - F @ S).max() < ROUNDING


@pytest.mark.parametrize("rows", [[[1, 2], [2, 4]], [[1, 2, 3], [4, 5, 6], [5, 7, 9]]])
def test_cofactor_of_a_singular_tensor(rows: list[list[float]]) -> None:
    # Its definition without an inverse: cof(A)^T A = det(A) I, here zero, in whole numbers.
    A = np.array(rows, dtype=np.float64)
    cofactor = np.array(tensors.cofactor(A))
    assert cofactor.any()
    assert not (cofactor.T @ A).any()


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_axes_there_and_back(dimension: int) -> None:
    values = np.random.default_rng(0).normal(size=(5, dimension, dimension))
    there = tensors.components_first(values)
    assert there.shape == (dimension, dimension, 5)
    np.testing.assert_array_equal(tensors.particles_first(there, 5), values)


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_constant_components_are_spread_over_particles(dimension: int) -> None:
    F = np.zeros((dimension, dimension, 4))
    spread = tensors.particles_first(tensors.identity(F), 4)
    np.testing.assert_array_equal(spread, np.tile(np.eye(dimension), (4, 1, 1)))
