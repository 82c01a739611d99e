"""What particles carry, at any point: exact to the second degree up to the surface."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.model.interpolation import shape_functions
from tests.helpers.examples import examples


def lattice(d: int, cells: int, *, on_boundary: bool = False) -> np.ndarray:
    """Particles of a cube of edge `cells`, a spacing of 1 apart."""
    along = np.arange(cells + 1.0) if on_boundary else np.arange(cells) + 0.5
    return np.stack(np.meshgrid(*[along] * d, indexing="ij"), axis=-1).reshape(-1, d)


def anywhere(random: np.random.Generator, d: int, cells: int) -> np.ndarray:
    """Points inside a cube, on its faces, edges and corners."""
    inside = random.uniform(0.0, cells, (60, d))
    on_surface = random.random((60, d)) < 0.5
    moved = np.where(on_surface, np.round(inside / cells) * cells, inside)
    return np.concatenate([inside, moved, np.zeros((1, d)), np.full((1, d), float(cells))])


@examples(60)
@given(
    d=st.sampled_from([1, 2, 3]),
    cells=st.integers(3, 6),
    on_boundary=st.booleans(),
    jitter=st.sampled_from([0.0, 0.1, 0.25]),
    spacing=st.sampled_from([1e-4, 1.0, 1e3]),
    seed=st.integers(0, 2**32 - 1),
)
def test_quadratic_fields_and_their_slopes_are_exact_up_to_the_surface(
    d: int, cells: int, on_boundary: bool, jitter: float, spacing: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    X = lattice(d, cells, on_boundary=on_boundary)
    X = np.clip(X + random.uniform(-jitter, jitter, X.shape), 0.0, cells)
    points = anywhere(random, d, cells)
    functions = shape_functions(spacing * X, spacing, spacing * points)
    A, b = random.normal(size=(d, d)), random.normal(size=d)

    def field(x: np.ndarray) -> np.ndarray:
        return 1.0 + x @ b + np.einsum("ni,ij,nj->n", x, A, x)

    values = field(X)
    # Weights add up to at most 12 in absolute value; the fits lose some two digits.
    rounding = 1e-13 * np.abs(values).max()
    assert functions.values @ values == pytest.approx(field(points), abs=rounding)
    exact = b + points @ (A + A.T)
    for axis, slope in enumerate(functions.slopes):
        assert spacing * (slope @ values) == pytest.approx(exact[:, axis], abs=10.0 * rounding)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("on_boundary", [False, True])
def test_the_error_of_a_smooth_field_is_of_the_third_order(d: int, on_boundary: bool) -> None:
    random = np.random.default_rng(1)
    errors = []
    for cells in (6, 12):
        X = lattice(d, cells, on_boundary=on_boundary) / cells
        points = anywhere(random, d, 1)
        functions = shape_functions(X, 1.0 / cells, points)
        wave = np.sin(2.0 * X).prod(axis=1)
        error = functions.values @ wave - np.sin(2.0 * points).prod(axis=1)
        errors.append(np.abs(error).max())
    # 8 in the limit; 4 would be the second order.
    assert errors[0] > 5.5 * errors[1]


def test_what_particles_do_not_determine_is_left_out() -> None:
    points = np.array([[0.3, 0.1], [1.0, 0.9]])
    one = shape_functions(np.zeros((1, 2)), 1.0, points)
    assert one.values.toarray() == pytest.approx(np.ones((2, 1)))
    # Two rows know squares along, but across them no more than a slope.
    along = np.array([[x, y] for x in range(5) for y in (0.0, 1.0)])
    two = shape_functions(along, 1.0, points)
    x, y = along.T
    assert two.values @ (x**2 + y + x * y) == pytest.approx(
        points[:, 0] ** 2 + points[:, 1] + points.prod(axis=1), abs=1e-13
    )
    assert two.values @ y**2 == pytest.approx(points[:, 1], abs=1e-13)


def test_a_point_depends_on_what_it_sees() -> None:
    X = lattice(2, 6)
    left = X[:, 0] < 3.0
    points = np.array([[2.9, 2.0], [3.0, 0.0]])

    def sees(points: np.ndarray, near: np.ndarray) -> np.ndarray:
        return left[near]

    functions = shape_functions(X, 1.0, points, sees)
    assert not functions.values.toarray()[:, ~left].any()
    field = np.where(left, X[:, 0] ** 2, 1e9)
    assert functions.values @ field == pytest.approx(points[:, 0] ** 2, rel=1e-13)
