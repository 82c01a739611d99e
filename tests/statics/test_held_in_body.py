"""Motions that cost nothing on a coarse grid, and something or nothing in the body."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

from solidsph.statics.held_in_body import held_in_body


@attrs.frozen
class Particles:
    """A stand-in for a coarse space: each function is the displacement of a particle."""

    count: int

    def matrix(self, pattern: int) -> csr_array:
        return csr_array(eye_array(self.count))


@pytest.mark.parametrize(("stiffness", "held"), [(1e-2, True), (6e-6, True), (1e-16, False)])
def test_soft_motions_are_held_and_free_ones_are_not(stiffness: float, held: bool) -> None:
    """Two particles that move alike for nothing on the grid, and a stiff third."""
    grid = csr_array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    space: Any = Particles(3)
    found = held_in_body(space, 0, grid, np.ones((3, 1), dtype=np.bool_), lambda x: stiffness * x)
    assert (found is not None) == held
