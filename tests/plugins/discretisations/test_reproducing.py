"""Functions of particles that reproduce polynomials."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.maths.arrays import Array
from solidsph_builtin.discretisations._grid import grid_over
from solidsph_builtin.discretisations._reproducing import Fit
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.shapes.box import Box


def shares(particles: Array) -> Array:
    """Of a straight line from the first of the `particles` to the last, by functions of them."""
    grid = grid_over(Lattice(on_boundary=True), Box(lengths=(10.0, 10.0)), 1.0, on_boundary=True)
    parts = (np.arange(400) + 0.5) / 400
    points = np.outer(1.0 - parts, particles[0]) + np.outer(parts, particles[-1])
    sizes = np.full(400, np.linalg.norm(particles[-1] - particles[0]) / 400)
    found: Array = Fit(particles, 1.0, grid).integrals(points, sizes[:, None])[:, 0]
    return found


@pytest.mark.parametrize("off", [1e-19, 1e-9])
def test_rounding_takes_nobodys_share(off: float) -> None:
    """The end of a line, alone off it by rounding, is not what a function across it is for."""
    line = np.stack([0.03 + np.arange(8.0), np.full(8, 0.5)], axis=1)
    expected = shares(line)
    assert expected[0] > 0.35
    line[0, 1] -= off
    assert shares(line) == pytest.approx(expected, abs=1e-6)


def eighth_of_a_ball() -> Fit:
    """The particles of a lattice in it, and some in disorder, in units of the spacing."""
    shape = Box(lengths=(7.0, 7.0, 7.0))
    grid = grid_over(Lattice(on_boundary=True), shape, 1.0, on_boundary=True)
    axis = np.arange(8.0)
    X = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    X = X[np.linalg.norm(X, axis=1) <= 7.0]
    disorder = np.random.default_rng(5).uniform(-0.1, 0.1, X.shape)
    far = np.linalg.norm(X, axis=1) > 4.0
    return Fit(np.where(far[:, None], np.maximum(X + disorder, 0.0), X), 1.0, grid)


def samples() -> tuple[Array, Array]:
    """Middles of small cells of an eighth of a ball, and their volumes."""
    axis = (np.arange(28) + 0.5) / 4.0
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[np.linalg.norm(points, axis=1) < 7.0]
    return points, np.full(len(points), 1.0 / 64.0)


def test_a_corner_gets_a_part_of_what_is_nearest_to_it() -> None:
    """Of its eighth of a cell; the fit alone gives it a quarter of that, or less."""
    fit, (points, weights) = eighth_of_a_ball(), samples()
    wanted = np.ones(len(fit.particles), dtype=np.bool_)
    corner = int(np.argmin(np.linalg.norm(fit.particles, axis=1)))
    alone = fit._above(points, weights[:, None], np.zeros(len(wanted)))[:, 0]
    assert alone[corner] < 0.25 / 8.0
    found = fit.positive_integrals(points, weights, wanted)
    assert found[corner] == pytest.approx(0.3 / 8.0)
    # It is taken from others so that no sum of a polynomial changes.
    X = fit.particles
    upper = np.triu_indices(3)
    f = np.hstack([np.ones((len(X), 1)), X, X[:, upper[0]] * X[:, upper[1]]])
    assert found @ f == pytest.approx(alone @ f, rel=1e-11)
