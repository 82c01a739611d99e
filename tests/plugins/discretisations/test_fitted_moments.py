"""Volumes and areas that integrate polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import SceneError
from solidsph.interfaces.discretisation import Discretisation
from solidsph_builtin.discretisations.conforming_lattice import ConformingLattice
from solidsph_builtin.discretisations.fitted_moments import FittedMoments
from solidsph_builtin.discretisations.jittered_lattice import JitteredLattice
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc


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


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_on_the_boundary_of_a_box_they_are_those_of_gregory(dimension: int) -> None:
    """3/8, 7/6, 23/24 and then whole cells, to the last bit where nothing is to be done."""
    lattice, shape = Lattice(on_boundary=True), Box(lengths=(1.2, 1.0, 1.0)[:dimension])
    particles = FittedMoments(of=lattice).particles(shape, 0.1)
    V, X = particles.volumes / 0.1**dimension, particles.positions
    from_left = np.round(X[:, 0] / 0.1).astype(int)
    middle = np.all(np.abs(X[:, 1:] - 0.5) < 0.01, axis=1)
    along = V[middle][np.argsort(from_left[middle])]
    gregory = [3 / 8, 7 / 6, 23 / 24, *(7 * [1.0]), 23 / 24, 7 / 6, 3 / 8]
    assert np.allclose(along, gregory, rtol=1e-9)
    deep = shape.signed_distance(X) < -4.2 * 0.1
    assert deep.any()
    assert np.array_equal(particles.volumes[deep], lattice.particles(shape, 0.1).volumes[deep])
    # In a corner almost the product of three of them.
    assert V.min() > 0.75 * (3 / 8) ** dimension


def test_a_face_belongs_to_the_particles_on_it() -> None:
    """All of it, and its middle."""
    shape = Box(lengths=(1.2, 1.0))
    block = FittedMoments(of=Lattice(on_boundary=True)).particles(shape, 0.1)
    bottom = block.faces["bottom"]
    X = block.positions[bottom.particles]
    # Samples of a quarter spacing leave the square of their size over that of the face.
    assert bottom.areas.sum() == pytest.approx(1.2, rel=1e-12)
    assert bottom.areas @ X == pytest.approx([0.72, 0.0], abs=1e-4)
    assert np.array_equal(X[:, 1], np.zeros(len(X)))
    assert np.array_equal(block.tags["bottom"], block.positions[:, 1] == 0.0)


def test_a_parabolic_load_has_its_sum() -> None:
    """Equal shares are the trapezoidal rule, which misses 1/n^2 of it."""
    shape = Box(lengths=(0.3, 1.0))

    def total(arrangement: Discretisation) -> float:
        particles = arrangement.particles(shape, 0.1)
        right = particles.faces["right"]
        Y = particles.positions[right.particles, 1]
        return float(6.0 * right.areas @ (Y * (1.0 - Y)))

    lattice = Lattice(on_boundary=True)
    assert total(lattice) == pytest.approx(1.0 - 1e-2)
    # What is left is the midpoint rule for samples of a quarter spacing: 1 / (2 40^2).
    assert total(FittedMoments(of=lattice)) == pytest.approx(1.0, abs=4e-4)


def test_beside_a_curved_face_volumes_and_areas_are_positive() -> None:
    shape = Difference(Box(lengths=(1.0, 1.0)), [Disc(radius=0.31)])
    particles = FittedMoments(of=ConformingLattice()).particles(shape, 0.05)
    area = 1.0 - np.pi * 0.31**2 / 4.0
    assert particles.volumes.min() > 0.0
    assert particles.volumes.sum() == pytest.approx(area, rel=1e-4)
    assert np.abs(particles.area_vectors.sum(axis=0)).max() < 1e-12
    X, V = particles.positions, particles.volumes
    # x^4 over the square less the quarter of a disc: beyond what is made exact.
    fourth = 0.2 - np.pi * 0.31**6 / 32.0
    assert V @ X[:, 0] ** 4 == pytest.approx(fourth, rel=1e-4)
    cut = ConformingLattice().particles(shape, 0.05)
    assert abs(cut.volumes @ cut.positions[:, 0] ** 4 - fourth) > 1e-3 * fourth


def test_scattered_particles_inside_their_cells() -> None:
    shape = Annulus(inner_radius=0.5, outer_radius=1.0)
    inner = JitteredLattice(amplitude=0.2, seed=1)
    particles = FittedMoments(of=inner).particles(shape, 0.1)
    V, X = particles.volumes, particles.positions
    assert V.min() > 0.0
    assert V.sum() == pytest.approx(np.pi * 0.75, rel=1e-3)
    # The surface is sampled by pieces of a fortieth of the radius: their square is left.
    assert V @ (X**2).sum(axis=1) == pytest.approx(np.pi / 2 * (1 - 0.5**4), rel=1e-3)


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

    with pytest.raises(SceneError, match="too thin for the spacing"):
        FittedMoments(of=Lattice()).particles(Wrong(lengths=(1.0, 1.0), origin=(-0.5, -0.5)), 0.2)
