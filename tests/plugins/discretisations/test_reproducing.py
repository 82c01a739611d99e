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
    found: Array = Fit(particles, 1.0, grid).integrals(points, sizes[:, None], sizes)[:, 0]
    return found


@pytest.mark.parametrize("off", [1e-19, 1e-9])
def test_rounding_takes_nobodys_share(off: float) -> None:
    """The end of a line, alone off it by rounding, is not what a function across it is for."""
    line = np.stack([0.03 + np.arange(8.0), np.full(8, 0.5)], axis=1)
    expected = shares(line)
    assert expected[0] > 0.35
    line[0, 1] -= off
    assert shares(line) == pytest.approx(expected, abs=1e-6)
