"""Volumes fitted to the moments of the body."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import SceneError
from solidsph_builtin.discretisations.fitted_moments import FittedMoments
from solidsph_builtin.discretisations.jittered_lattice import JitteredLattice
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.box import Box


@given(
    cells=st.integers(4, 9),
    on_boundary=st.booleans(),
    width=st.floats(0.5, 3.0),
    x0=st.floats(-2.0, 2.0),
)
def test_a_box_has_its_moments(cells: int, on_boundary: bool, width: float, x0: float) -> None:
    shape = Box(lengths=(width, 1.0), origin=(x0, -0.5))
    particles = FittedMoments(of=Lattice(on_boundary=on_boundary)).particles(shape, 1.0 / cells)
    V, X = particles.volumes, particles.positions
    # The samples of straight edges are integrated exactly; rounding is left.
    assert V.sum() == pytest.approx(width, rel=1e-12)
    assert V @ X[:, 1] ** 2 == pytest.approx(width / 12.0, rel=1e-10)
    along = X[:, 0] - x0 - width / 2
    if len(np.unique(np.round(along, 9))) > 2:
        assert V @ along**2 == pytest.approx(width**3 / 12.0, rel=1e-10)
    assert np.abs(V @ X[:, 1]) < 1e-12 * width


def test_without_the_fit_the_section_is_too_soft_or_too_stiff() -> None:
    """1 - 1/n^2 for n cell centres; 1 + 2/n^2 for n cells with particles on the boundary."""
    shape = Box(lengths=(1.0, 1.0), origin=(0.0, -0.5))
    for on_boundary, expected in ((False, 1 - 1 / 25), (True, 1 + 2 / 25)):
        particles = Lattice(on_boundary=on_boundary).particles(shape, 0.2)
        second = particles.volumes @ particles.positions[:, 1] ** 2
        assert second * 12.0 == pytest.approx(expected, rel=1e-12)


def test_a_curved_body_and_scattered_particles() -> None:
    shape = Annulus(inner_radius=0.5, outer_radius=1.0)
    inner = JitteredLattice(amplitude=0.2, seed=1)
    particles = FittedMoments(of=inner).particles(shape, 0.1)
    V, X = particles.volumes, particles.positions
    assert V.sum() == pytest.approx(np.pi * 0.75, rel=1e-3)
    # The surface is sampled by pieces of a fortieth of the radius: their square is left.
    assert V @ (X**2).sum(axis=1) == pytest.approx(np.pi / 2 * (1 - 0.5**4), rel=1e-3)
    change = V / inner.particles(shape, 0.1).volumes - 1.0
    assert np.abs(change).max() < 0.1


def test_a_body_one_particle_thick_keeps_what_cannot_be_fitted() -> None:
    shape = Box(lengths=(1.0, 0.1))
    particles = FittedMoments(of=Lattice()).particles(shape, 0.1)
    V, X = particles.volumes, particles.positions
    assert V @ (X[:, 0] - 0.5) ** 2 == pytest.approx(0.1 / 12.0, rel=1e-9)
    assert np.ptp(X[:, 1]) < 1e-12


def test_a_fit_that_would_need_negative_volumes_is_refused() -> None:
    class Wrong(Box):
        """A box whose surface says that it is three times as wide."""

        def surface(self, spacing):
            import attrs

            found = super().surface(spacing)
            return attrs.evolve(found, points=found.points * [3.0, 1.0])

    with pytest.raises(SceneError, match="too thin for positive volumes"):
        FittedMoments(of=Lattice()).particles(Wrong(lengths=(1.0, 1.0), origin=(-0.5, -0.5)), 0.2)
