"""The smooth part of a field: what is kept, what goes, and that the filter is its own adjoint."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.model.neighbours import neighbour_pairs
from solidsph.model.smooth_part import REACH, SmoothPart
from tests.helpers.examples import examples
from tests.model.test_interpolation import lattice

# Of sums of some hundred numbers of size 1.
ROUNDING = 1e-11

# The ridge on the moments is 1e-12 of them, and at a corner their least part some thousandth.
RIDGE = 1e-9


def smooth_part_of(X: np.ndarray, spacing: float = 1.0, kept: np.ndarray | None = None):
    n, d = X.shape
    spacings, volumes = np.full(n, spacing), np.full(n, spacing**d)
    volumes *= np.random.default_rng(n).uniform(0.5, 1.0, n)  # as beside a surface
    all_kept = np.ones(n, dtype=np.bool_) if kept is None else kept
    return SmoothPart.of(neighbour_pairs(X, REACH * spacing), spacings, volumes, all_kept)


@examples(60)
@given(
    d=st.sampled_from([2, 3]),
    cells=st.integers(3, 6),
    jitter=st.sampled_from([0.0, 0.1, 0.25]),
    spacing=st.sampled_from([1e-4, 1.0, 1e3]),
    seed=st.integers(0, 2**32 - 1),
)
def test_quadratic_fields_are_kept_and_the_filter_is_its_own_adjoint(
    d: int, cells: int, jitter: float, spacing: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    X = lattice(d, cells, on_boundary=True)
    X = X + jitter * random.uniform(-1.0, 1.0, X.shape)
    smooth_part = smooth_part_of(spacing * X, spacing)
    quadratic = 1.0 + X @ random.normal(size=d) + np.sum((X @ random.normal(size=(d, d))) * X, 1)
    assert np.abs(smooth_part.change(quadratic)).max() <= RIDGE * np.abs(quadratic).max()
    f, g = random.normal(size=(2, len(X)))
    V = smooth_part.volumes
    apart = (V * g) @ smooth_part.change(f) - (V * f) @ smooth_part.change(g)
    assert abs(apart) <= ROUNDING * V.sum()


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("along", [1, 2, 3])
def test_what_alternates_goes_and_what_is_long_stays(d: int, along: int) -> None:
    """Away from surfaces, of waves along one or several axes."""
    X = lattice(d, 15)
    axes = X[:, : min(along, d)]
    inside = np.all(np.abs(X - 7.5) < 3.0, axis=1)
    smooth_part = SmoothPart(smooth_part_of(X).rows, np.ones(len(X)))

    def left(wave_length: float) -> float:
        field = np.prod(np.cos(2.0 * np.pi * axes / wave_length + 0.3), axis=1)
        return float(
            np.abs((field + smooth_part.change(field))[inside]).max() / np.abs(field[inside]).max()
        )

    assert left(2.0) <= 0.3
    assert left(8.0) >= 0.98


def test_what_is_not_kept_neither_counts_nor_changes() -> None:
    X = lattice(2, 8)
    kept = X[:, 0] > 2.0
    smooth_part = smooth_part_of(X, kept=kept)
    field = np.random.default_rng(0).normal(size=len(X))
    other = np.where(kept, field, 1e3)
    assert np.array_equal(smooth_part.change(field), smooth_part.change(other))
    assert not smooth_part.change(field)[~kept].any()


def test_the_matrix_is_the_change() -> None:
    smooth_part = smooth_part_of(lattice(2, 7))
    field = np.random.default_rng(1).normal(size=49)
    assert smooth_part.matrix @ field == pytest.approx(smooth_part.change(field), abs=1e-13)


def test_of_too_few_neighbours_what_they_tell_is_kept() -> None:
    """A single particle, and a row, whose neighbours determine no quadratic in the plane."""
    assert smooth_part_of(np.zeros((1, 2))).change(np.ones(1)) == pytest.approx(0.0)
    row = np.stack([np.arange(6.0), np.zeros(6)], axis=1)
    assert smooth_part_of(row).change(row[:, 0] ** 2) == pytest.approx(0.0, abs=RIDGE)
