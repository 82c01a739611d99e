"""Compiled loops of large bodies against the arrays that do the same for small ones."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from solidsph_builtin.discretisations import _relaxation, _reproducing
from solidsph_builtin.discretisations._grid import Grid
from solidsph_builtin.discretisations._relaxation import relaxed
from solidsph_builtin.discretisations._reproducing import Fit

CELLS = 8
NEVER = 10**9


def scattered(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Particles about 1 apart, and points among them and some beside."""
    random = np.random.default_rng(3)
    axes = np.meshgrid(*[np.arange(CELLS + 1.0)] * dimension, indexing="ij")
    X = np.stack(axes, axis=-1).reshape(-1, dimension)
    X += random.uniform(-0.2, 0.2, X.shape)
    return X, random.uniform(-0.5, CELLS + 0.5, (500, dimension))


def fit(X: np.ndarray) -> Fit:
    d = X.shape[1]
    counts = (CELLS + 1,) * d
    return Fit(X, 1.0, Grid(np.zeros(d), np.full(d, float(CELLS)), (CELLS,) * d, 0.0, counts))


@pytest.mark.parametrize("dimension", [2, 3])
def test_fits_by_loops_are_those_by_arrays(dimension: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same sums in another order: beside their size, to rounding in ill-determined fits."""
    X, points = scattered(dimension)
    # One far away, whose fit has the nearest particle alone.
    points = np.concatenate([points, np.full((1, dimension), -9.0)])
    weights = np.random.default_rng(4).uniform(0.5, 1.5, (len(points), 2))
    found = []
    for many in (NEVER, 0):
        monkeypatch.setattr(_reproducing, "_MANY", many)
        found.append(fit(X).integrals(points, weights))
    assert np.abs(found[1] - found[0]).max() < 1e-9
    assert np.abs(found[1].sum(axis=0) - weights.sum(axis=0)).max() < 1e-9


def test_fits_do_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("needs two threads")
    X, points = scattered(3)
    weights = np.ones((len(points), 1))
    monkeypatch.setattr(_reproducing, "_MANY", 0)
    found, before = [], numba.get_num_threads()
    try:
        for threads in (1, 2):
            numba.set_num_threads(threads)
            found.append(fit(X).integrals(points, weights))
    finally:
        numba.set_num_threads(before)
    assert np.array_equal(*found)


@pytest.mark.parametrize("dimension", [2, 3])
def test_relaxation_by_loops_is_that_by_arrays(
    dimension: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    X, _ = scattered(dimension)
    free = np.all((X > 1.5) & (X < CELLS - 1.5), axis=1)
    found = []
    for many in (NEVER, 0):
        monkeypatch.setattr(_relaxation, "_MANY", many)
        found.append(relaxed(X, free, lambda x: 1.0 + 0.1 * x[:, 0] / CELLS, steps=10))
    assert np.abs(found[0] - X)[free].max() > 0.05
    assert np.array_equal(found[0][~free], X[~free])
    # Sums in another order, in ten steps of which each moves on from the last.
    assert np.abs(found[1] - found[0]).max() < 1e-12


def test_relaxed_particles_have_the_distance_that_is_wished_at_their_place() -> None:
    """On a line between two that are held, steps grow as the wished distance does."""
    wished = np.array([1.0, 1.0, 1.0, 1.5, 1.5, 1.5])
    places = np.concatenate([[0.0], np.cumsum(wished)])
    start = np.linspace(0.0, places[-1], len(places))[:, None]
    free = np.ones(len(places), dtype=np.bool_)
    free[[0, -1]] = False
    found = relaxed(start, free, lambda x: np.where(x[:, 0] < 3.1, 1.0, 1.5), steps=2000)
    steps = np.diff(found[:, 0])
    assert steps[:2] == pytest.approx(1.0, abs=0.08)
    assert steps[-2:] == pytest.approx(1.5, abs=0.12)
