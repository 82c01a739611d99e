"""Particles that follow the surface of any shape."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations.fitted import Fitted
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.ball import Ball
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.cylinder import Cylinder
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc
from solidsph_builtin.shapes.extruded import Extruded
from solidsph_builtin.shapes.interval import Interval
from solidsph_builtin.shapes.polygon import Polygon

TAPERED = Polygon(vertices=((0.0, 0.0), (4.8, 4.4), (4.8, 6.0), (0.0, 4.4)))
QUARTER = Difference(Box(lengths=(1.0, 1.0)), [Disc(radius=0.31)])


@given(
    sides=st.lists(st.floats(0.5, 1.0), min_size=1, max_size=3),
    origin=st.floats(-3.0, 3.0),
)
def test_a_box_has_the_particles_of_a_lattice_to_the_last_bit(
    sides: list[float], origin: float
) -> None:
    box = Box(lengths=sides, origin=[origin] * len(sides))
    found = Fitted().particles(box, 0.25)
    lattice = Lattice(on_boundary=True).particles(box, 0.25)
    assert np.array_equal(found.positions, lattice.positions)
    assert found.tags.keys() == lattice.tags.keys()
    for tag in found.tags:
        assert np.array_equal(found.tags[tag], lattice.tags[tag])


@given(cells=st.integers(8, 200), length=st.floats(0.1, 10.0))
def test_volumes_of_a_bar_are_those_of_gregorys_rule(cells: int, length: float) -> None:
    """3/8, 7/6, 23/24, 1 from either end, however many cells there are: to rounding."""
    found = Fitted().particles(Interval(length=length), length / cells)
    expected = np.ones(cells + 1)
    expected[:3] = expected[:-4:-1] = 3.0 / 8.0, 7.0 / 6.0, 23.0 / 24.0
    assert found.volumes * (cells / length) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "spacing"),
    [
        (Annulus(inner_radius=0.5, outer_radius=1.0), 0.07),
        (QUARTER, 0.05),
        (QUARTER, 0.0333),
        (TAPERED, 0.2),
        (Difference(Box(lengths=(1.0, 1.0)), [Disc(radius=0.2, centre=(0.5, 0.5))]), 0.05),
    ],
)
def test_in_the_plane_distances_are_even(shape: Shape, spacing: float) -> None:
    particles = Fitted().particles(shape, spacing)
    gaps = nearest(particles.positions) / spacing
    # Where two edges meet at an acute angle, particles on them are closer.
    assert gaps.min() > 0.8
    assert gaps.max() < 1.25
    on_surface = particles.tags["surface"]
    depth = -shape.signed_distance(particles.positions)
    assert np.abs(depth[on_surface]).max() < 1e-9 * spacing
    assert depth[~on_surface].min() > 0.4 * spacing
    assert particles.volumes.min() > 0.0


def test_along_a_circle_steps_are_equal() -> None:
    particles = Fitted().particles(Annulus(inner_radius=0.5, outer_radius=1.0), 0.07)
    for face, radius in (("inner", 0.5), ("outer", 1.0)):
        x, y = particles.positions[particles.tags[face]].T
        assert np.hypot(x, y) == pytest.approx(radius)
        steps = np.diff(np.sort(np.arctan2(y, x))) * radius
        assert len(steps) + 1 == 4 * round(0.5 * np.pi * radius / 0.07)
        # The circle is sampled by chords, of which an arc is longer by 1e-5.
        assert steps.max() < steps.min() * (1.0 + 1e-4)


def test_corners_have_particles() -> None:
    particles = Fitted().particles(TAPERED, 0.2)
    gaps = cKDTree(particles.positions).query(np.array(TAPERED.vertices))[0]
    assert gaps.max() < 1e-9
    quarter = Fitted().particles(QUARTER, 0.05)
    # Where an arc meets a straight side, as well as planes through samples of the arc meet it.
    assert cKDTree(quarter.positions).query([[0.31, 0.0], [0.0, 0.31]])[0].max() < 1e-6


@pytest.mark.parametrize(
    ("shape", "spacing", "volume"),
    [
        (Annulus(inner_radius=0.5, outer_radius=1.0), 0.07, np.pi * 0.75),
        (QUARTER, 0.05, 1.0 - np.pi * 0.31**2 / 4.0),
        (TAPERED, 0.2, 14.4),
        (Ball(radius=1.0), 0.25, 4.0 * np.pi / 3.0),
    ],
)
def test_the_divergence_theorem_holds_for_quadratic_functions(
    shape: Shape, spacing: float, volume: float
) -> None:
    """The sum of f A is that of V grad f: a uniform stress is in balance with its loads."""
    particles = Fitted().particles(shape, spacing)
    X, V, A = particles.positions, particles.volumes, particles.area_vectors
    assert V.sum() == pytest.approx(volume, rel=2e-3)  # the surface is sampled by flat pieces
    size = np.abs(A).sum()
    assert np.abs(A.sum(axis=0)).max() < 1e-12 * size
    d = shape.dimension
    assert np.abs(X.T @ A - V.sum() * np.eye(d)).max() < 1e-11 * size
    f = X[:, 0] * X[:, 1]
    slope = np.zeros(d)
    slope[:2] = V @ X[:, 1], V @ X[:, 0]
    assert np.abs(f @ A - slope).max() < 1e-11 * size


def eighth(radius: float, hollow: float) -> Shape:
    """Of a ball, `hollow` inside up to that radius."""
    side = 3.0 * radius
    beyond = [
        Box(
            lengths=[0.5 * side if axis == cut else side for axis in range(3)],
            origin=[-0.5 * side] * 3,
        )
        for cut in range(3)
    ]
    inside = [Ball(radius=hollow)] if hollow else []
    return Difference(Ball(radius=radius), [*inside, *beyond])


def test_an_eighth_of_a_ball_has_positive_areas_of_particles_on_each_face() -> None:
    """What a plane of symmetry holds is all that owns a part of it."""
    found = Fitted().particles(eighth(1.0, 0.0), 1.0 / 7.0)
    planes = 0
    for face in found.faces.values():
        X = found.positions[face.particles]
        flat = np.abs(X).max(axis=0) < 1e-9
        planes += int(flat.sum())
        assert flat.any() or np.linalg.norm(X, axis=1) == pytest.approx(1.0)
        assert face.areas.min() > 0.0
    assert planes == 3


def test_volumes_along_a_circle_are_even() -> None:
    """Beside 3/8 of a cell. Fits to those within 1.8 spacings scatter by 0.10 of a cell."""
    h = 1.0 / 14.0
    ring = Fitted().particles(Annulus(inner_radius=1.0, outer_radius=2.0), h)
    inner = ring.volumes[ring.tags["inner"]] / h**2
    assert inner.mean() == pytest.approx(3.0 / 8.0, abs=0.03)
    assert inner.std() < 0.05


@pytest.mark.validation
def test_volumes_along_a_rim_in_space_are_even() -> None:
    """Where the fits may extrapolate, they scatter by 0.10 of a cell."""
    h = 1.0 / 8.0
    hollow = Fitted().particles(eighth(2.0, 1.0), h)
    X = hollow.positions
    rim = np.abs(np.linalg.norm(X, axis=1) - 1.0) < 1e-2 * h
    rim &= (np.abs(X) < 1e-9).sum(axis=1) == 1
    inner = hollow.volumes[rim] / h**3
    assert len(inner) > 30
    assert inner.std() < 0.05


def test_particles_on_a_surface_off_the_lattice_weigh_less_in_fits() -> None:
    h = 0.05
    quarter = Fitted().particles(QUARTER, h)
    surface = quarter.tags["surface"]
    assert np.array_equal(quarter.cells[~surface], quarter.volumes[~surface])
    assert quarter.cells[surface] == pytest.approx(h**2 / 3.0)
    assert Fitted().particles(Box(lengths=(1.0, 1.0)), h).cells == pytest.approx(h**2)


@pytest.mark.parametrize(
    ("shape", "spacing"),
    [
        pytest.param(Ball(radius=1.0), 0.2, id="ball"),
        pytest.param(Ball(radius=1.0), 0.15, id="finer ball"),
        pytest.param(Cylinder(radius=0.5, length=1.0), 0.1, id="cylinder"),
        pytest.param(eighth(2.0, 1.0), 0.2, id="eighth of a hollow ball"),
        pytest.param(
            Extruded(of=Annulus(inner_radius=0.5, outer_radius=1.0), length=0.6), 0.125, id="tube"
        ),
        pytest.param(Extruded(of=QUARTER, length=0.3), 0.06, id="plate with a hole"),
    ],
)
def test_in_space_distances_are_even(shape: Shape, spacing: float) -> None:
    particles = Fitted().particles(shape, spacing)
    X, on_surface = particles.positions, particles.tags["surface"]
    gaps = nearest(X) / particles.spacings[0]
    assert gaps.min() > 0.8
    assert gaps.max() < 1.25
    depth = -shape.signed_distance(X) / spacing
    assert np.abs(depth[on_surface]).max() < 1e-6
    assert depth[~on_surface].min() > 0.4
    # No place of the surface is further from a particle than the corner of a cell, and some more.
    assert cKDTree(X[on_surface]).query(shape.surface(spacing).points)[0].max() < 0.95 * spacing
    assert particles.volumes.min() > 0.0


def test_edges_in_space_have_particles_in_equal_steps() -> None:
    h, radius = 0.1, 0.5
    X = Fitted().particles(Cylinder(radius=radius, length=1.0), h).positions
    ends = X[:, 2].min(), X[:, 2].max()
    for end in ends:
        rim = X[np.isclose(X[:, 2], end) & np.isclose(np.hypot(*X[:, :2].T), radius, rtol=1e-6)]
        steps = np.diff(np.sort(np.arctan2(rim[:, 1], rim[:, 0]))) * radius
        # A quarter is 7.9 spacings long; rather too few than too many.
        assert len(rim) == 4 * 7
        # The rim is found as a chain of chords a tenth of a spacing long.
        assert steps.max() < steps.min() * 1.01


@pytest.mark.parametrize("around", [3.2, 5.0, 7.5])
def test_steps_around_small_holes_are_even(around: float) -> None:
    """Where no multiple of four fits."""
    h = 0.1
    hole = Disc(radius=around * h / (2.0 * np.pi), centre=(0.5, 0.5))
    shape = Difference(Box(lengths=(1.0, 1.0)), [hole])
    gaps = nearest(Fitted().particles(shape, h).positions) / h
    assert gaps.min() > 0.75
    assert gaps.max() < 1.25


def test_corners_in_space_have_particles() -> None:
    X = Fitted().particles(eighth(2.0, 1.0), 0.2).positions
    corners = np.concatenate([np.eye(3), 2.0 * np.eye(3)])
    # Where arcs meet, as well as planes through samples of the balls meet.
    assert cKDTree(X).query(corners)[0].max() < 1e-3


def test_second_moments_of_a_ball() -> None:
    """As well as flat samples of its surface tell them."""
    particles = Fitted().particles(Ball(radius=1.0), 0.2)
    assert np.abs(second_moment(particles) - 4.0 * np.pi / 15.0).max() < 4e-3


def second_moment(particles: Particles) -> Array:
    return np.asarray(particles.volumes @ particles.positions**2)


def nearest(X: Array) -> Array:
    return np.asarray(cKDTree(X).query(X, k=[2])[0][:, 0])
