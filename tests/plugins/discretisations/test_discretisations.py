"""Discretisations: volumes, areas, tags and ghosts against closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from solidsph.errors import SceneError
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations._noise import moved_inside
from solidsph_builtin.discretisations.conforming_lattice import ConformingLattice
from solidsph_builtin.discretisations.fitted import Fitted
from solidsph_builtin.discretisations.jittered import Jittered
from solidsph_builtin.discretisations.jittered_lattice import JitteredLattice
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.discretisations.points import Points
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.ball import Ball
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.cylinder import Cylinder
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc
from solidsph_builtin.shapes.interval import Interval
from solidsph_builtin.shapes.polygon import Polygon
from solidsph_builtin.shapes.union import Union
from tests.helpers.examples import examples

SHAPES: list[Shape] = [
    Interval(2.0, origin=0.5),
    Box([1.0, 0.63], origin=[-3.0, 2.0]),
    Box([1.0, 0.5, 0.4]),
    Disc(0.8, [1.0, 1.0]),
    Annulus(0.5, 1.0),
    Ball(0.6, [1.0, 2.0, 3.0]),
    Cylinder(0.5, 1.0, axis="y"),
    Polygon([(0.0, 0.0), (2.0, -1.0), (1.2, 0.0), (2.0, 1.0)]),
    Union([Box([1.0, 1.0]), Box([1.0, 0.5], [1.0, 0.25])]),
    Difference(Box([1.0, 1.0]), Disc(0.3)),
    Difference(Box([1.0, 1.0]), Box([0.5, 0.5], [0.25, 0.0])),
]
CONVEX = [shape for shape in SHAPES if isinstance(shape, Interval | Box | Disc | Ball | Cylinder)]
ARRANGEMENTS: list[Discretisation] = [
    Lattice(),
    Lattice(on_boundary=True),
    Lattice(ghosts=2),
    Lattice(on_boundary=True, ghosts=2),
    JitteredLattice(amplitude=0.3, seed=5, ghosts=1),
    ConformingLattice(),
    Jittered(of=ConformingLattice(), amplitude=0.3, seed=5),
]


def name_of(value: object) -> str:
    return type(value).__name__ if isinstance(value, Shape | Discretisation) else ""


def area(particles: Particles) -> float:
    """That of the surface; by faces, for what one particle owns of opposite faces cancels."""
    faces = particles.faces.values()
    return float(sum(np.linalg.norm(face.area_vectors, axis=1).sum() for face in faces))


def closure(particles: Particles) -> float:
    """What is missing of a closed surface, as a part of all its area."""
    return float(np.linalg.norm(particles.area_vectors.sum(axis=0)) / area(particles))


def enclosed(particles: Particles) -> float:
    """Volume by the divergence theorem, from positions and area vectors of the particles."""
    return float(np.sum(particles.positions * particles.area_vectors)) / particles.dimension


# What holds for every arrangement ----------------------------------------------------------------


@pytest.mark.parametrize("arrangement", ARRANGEMENTS, ids=name_of)
@pytest.mark.parametrize("shape", SHAPES, ids=name_of)
def test_every_arrangement_keeps_the_promises(shape: Shape, arrangement: Discretisation) -> None:
    particles = arrangement.particles(shape, 0.09)
    count, dimension = particles.count, shape.dimension
    real = ~particles.ghosts

    for array, expected in (
        (particles.positions, (count, dimension)),
        (particles.images, (count, dimension)),
        (particles.area_vectors, (count, dimension)),
        (particles.volumes, (count,)),
        (particles.spacings, (count,)),
    ):
        assert array.shape == expected
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        assert np.isfinite(array).all()

    assert (shape.signed_distance(particles.positions[real]) <= 1e-9).all()
    assert (shape.signed_distance(particles.positions[~real]) >= -1e-12).all()
    assert (particles.volumes > 0.0).all()
    assert closure(particles) < 1e-12
    assert not particles.area_vectors[particles.ghosts].any()
    np.testing.assert_array_equal(particles.images[real], particles.positions[real])
    assert not particles.bodies

    faces = set(shape.surface(0.09).faces)
    assert faces <= set(particles.tags)
    assert set(particles.faces) == faces
    tags = particles.tags
    np.testing.assert_array_equal(
        tags["surface"], np.logical_or.reduce([tags[face] for face in faces])
    )
    np.testing.assert_array_equal(tags["interior"], real & ~tags["surface"])
    np.testing.assert_array_equal(tags["ghosts"], particles.ghosts)
    if particles.ghosts.any():
        ghosts_of_faces = sum(tags[f"{face}-ghosts"].astype(int) for face in faces)
        np.testing.assert_array_equal(ghosts_of_faces, particles.ghosts)

    total = np.zeros_like(particles.area_vectors)
    for name, face in particles.faces.items():
        np.testing.assert_array_equal(np.flatnonzero(tags[name]), face.particles)
        total[face.particles] += face.area_vectors
    np.testing.assert_array_equal(total, particles.area_vectors)


@pytest.mark.parametrize("arrangement", ARRANGEMENTS, ids=name_of)
@pytest.mark.parametrize(
    "shape", [Box([1.0, 0.5, 0.4]), Difference(Box([1.0, 1.0]), Disc(0.3))], ids=name_of
)
def test_same_input_gives_the_same_bits(shape: Shape, arrangement: Discretisation) -> None:
    one, other = (arrangement.particles(shape, 0.11) for _ in range(2))
    for field in attrs.fields(Particles):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(a, b)
    assert list(one.tags) == list(other.tags)


@pytest.mark.parametrize(
    "arrangement",
    [
        Lattice(),
        Lattice(True),
        JitteredLattice(0.4, 1),
        ConformingLattice(),
        Jittered(ConformingLattice(), 0.4, 1),
    ],
)
@pytest.mark.parametrize("shape", SHAPES, ids=name_of)
@pytest.mark.parametrize("spacing", [0.1, 0.037])
def test_volumes_add_up_exactly_where_the_shape_knows(
    shape: Shape, arrangement: Discretisation, spacing: float
) -> None:
    volume = shape.volume()
    if volume is not None and not (shape.dimension == 3 and spacing < 0.05):
        total = arrangement.particles(shape, spacing).volumes.sum()
        assert total == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (Difference(Box([1.0, 1.0]), Disc(0.3)), 1.0 - 0.0225 * math.pi),
        (Difference(Box([1.0, 1.0]), Disc(0.3, [0.5, 0.5])), 1.0 - 0.09 * math.pi),
        (Difference(Disc(1.0), Disc(0.4)), 0.84 * math.pi),
        (Union([Disc(0.5), Disc(0.5, [2.0, 0.0])]), 0.5 * math.pi),
        (Difference(Ball(0.7), Ball(0.4)), 4.0 / 3.0 * math.pi * 0.279),
    ],
    ids=name_of,
)
@pytest.mark.parametrize("arrangement", [Lattice(), Lattice(True), ConformingLattice()])
def test_volumes_of_composites_are_found_by_halving_cells(
    shape: Shape, volume: float, arrangement: Discretisation
) -> None:
    spacing = 0.1
    total = arrangement.particles(shape, spacing).volumes.sum()
    # The last pieces of a cut cell are 1/16 (in space 1/8) of it wide, w. A boundary with radius
    # R bends over one by w^2 / 8 R, and what a plane leaves is right on average over its tilts
    # only: together about 1e-3 of the cells cut, which make up less than a third of the body.
    assert total == pytest.approx(volume, rel=2e-4)


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (Union([Box([1.0, 1.0]), Box([1.0, 1.0], [1.0, 0.0])]), 2.0),
        (Union([Box([1.03, 1.0]), Box([0.97, 1.0], [1.03, 0.0])]), 2.0),
        (Union([Box([1.0, 1.0]), Box([1.0, 1.0], [0.52, 0.0])]), 1.52),
        (Difference(Box([1.0, 1.0]), Box([0.5, 0.5], [0.3, 0.0])), 0.75),
        (Difference(Box([1.0, 1.0]), Box([0.5, 1.0])), 0.5),
    ],
    ids=name_of,
)
@pytest.mark.parametrize("arrangement", [Lattice(), Lattice(True), ConformingLattice()])
def test_boxes_put_together_have_the_exact_volume(
    shape: Shape, volume: float, arrangement: Discretisation
) -> None:
    # Planes across the axes are what the last step of the halving gets right in full, and a seam
    # between two parts must not cost anything wherever it runs through the cells.
    particles = arrangement.particles(shape, 0.1)
    assert particles.volumes.sum() == pytest.approx(volume, rel=1e-10)


plane_shapes: st.SearchStrategy[Shape] = st.one_of(
    st.builds(Box, st.tuples(st.floats(0.3, 2.0), st.floats(0.3, 2.0))),
    st.builds(Disc, st.floats(0.3, 2.0), st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))),
    st.builds(lambda inner, width: Annulus(inner, inner + width), *[st.floats(0.2, 1.0)] * 2),
    st.builds(
        lambda a, b, c: Polygon([(0.0, 0.0), (1.0, a), (1.5, 1.0 + b), (0.2, 1.0 + c)]),
        *[st.floats(-0.5, 0.5)] * 3,
    ),
)


@examples(80)
@given(
    shape=plane_shapes,
    spacing=st.floats(0.04, 0.12),
    on_boundary=st.booleans(),
    ghosts=st.integers(0, 2),
)
def test_volume_and_closure_for_any_size_and_spacing(
    shape: Shape, spacing: float, on_boundary: bool, ghosts: int
) -> None:
    particles = Lattice(on_boundary, ghosts).particles(shape, spacing)
    assert closure(particles) < 1e-12
    if not (on_boundary and ghosts):
        real = ~particles.ghosts
        assert particles.volumes[real].sum() == pytest.approx(shape.volume(), rel=1e-12)


@examples(60)
@given(
    outer=plane_shapes,
    inner=plane_shapes,
    spacing=st.floats(0.05, 0.15),
    kind=st.sampled_from([Union, Difference]),
)
def test_composites_close_and_their_volumes_agree_with_counting(
    outer: Shape, inner: Shape, spacing: float, kind: Any
) -> None:
    shape = Union([outer, inner]) if kind is Union else Difference(outer, inner)
    try:
        particles = Lattice().particles(shape, spacing)
    except SceneError as error:  # nothing may be left of the outer shape
        assert "inside the shape" in str(error)  # noqa: PT017
        return
    assert closure(particles) < 1e-12
    lower, upper = shape.bounds()
    grid_points = lower + (np.indices((400, 400)).reshape(2, -1).T + 0.5) / 400.0 * (upper - lower)
    counted = np.prod(upper - lower) * (shape.signed_distance(grid_points) < 0.0).mean()
    # Along the boundary, counting misses up to half a square of its grid, and halving up to a
    # fraction of a last piece, 1/16 of a cell wide: both only here and there.
    width = 0.5 * (upper - lower).max() / 400.0 + 0.1 * spacing / 16.0
    assert abs(particles.volumes.sum() - counted) < width * area(particles)


@pytest.mark.parametrize("shape", CONVEX, ids=name_of)
def test_divergence_theorem_holds_better_the_finer_the_lattice(shape: Shape) -> None:
    # Particles at the centres of the cells carry the area at most half a cell off the boundary
    # and a diagonal along it, so that the volume is off by that times the area at most.
    volume, spacings = shape.volume(), (0.1, 0.05)
    assert volume is not None
    errors = []
    for spacing in spacings:
        particles = Lattice().particles(shape, spacing)
        errors.append(abs(enclosed(particles) - volume))
        assert errors[-1] <= 0.75 * spacing * area(particles) / shape.dimension
    assert errors[1] < 0.75 * errors[0]


@pytest.mark.parametrize("lengths", [[1.0], [1.0, 0.5], [1.0, 0.5, 0.4]])
def test_divergence_theorem_is_exact_with_particles_on_the_faces(lengths: list[float]) -> None:
    shape = Box(lengths)
    particles = Lattice(on_boundary=True).particles(shape, 0.1)
    assert enclosed(particles) == pytest.approx(shape.volume(), rel=1e-12)


# Lattice -----------------------------------------------------------------------------------------


def test_aligned_box_has_equal_volumes_and_exact_areas() -> None:
    particles = Lattice().particles(Box([1.0, 0.6, 0.3]), 0.1)
    assert particles.count == 10 * 6 * 3
    np.testing.assert_allclose(particles.volumes, 1e-3, rtol=1e-14)
    np.testing.assert_array_equal(particles.spacings, 0.1)
    left = particles.tagged("left")
    assert left.size == 6 * 3
    np.testing.assert_allclose(particles.area_vectors[left][:, 0], -0.01, rtol=1e-13)
    np.testing.assert_allclose(particles.positions[left][:, 0], 0.05, rtol=1e-13)
    corner = particles.tags["left"] & particles.tags["bottom"] & particles.tags["front"]
    np.testing.assert_allclose(particles.area_vectors[corner], [[-0.01] * 3], rtol=1e-13)
    np.testing.assert_allclose(particles.faces["left"].area_vectors, [[-0.01, 0, 0]] * 18)
    assert particles.tags["interior"].sum() == 8 * 4 * 1


def test_particles_on_the_boundary_have_halves_and_quarters_of_cells() -> None:
    particles = Lattice(on_boundary=True).particles(Box([1.0, 0.5], [2.0, 0.0]), 0.1)
    assert particles.count == 11 * 6
    at_x = np.isclose(particles.positions[:, 0], 2.0) | np.isclose(particles.positions[:, 0], 3.0)
    at_y = np.isclose(particles.positions[:, 1], 0.0) | np.isclose(particles.positions[:, 1], 0.5)
    np.testing.assert_array_equal(at_x | at_y, particles.tags["surface"])
    np.testing.assert_allclose(particles.volumes, 0.01 * 0.5**at_x * 0.5**at_y, rtol=1e-12)
    # On the faces to the last bit, so that a condition on x == 2 finds them.
    assert (particles.positions[:, 0].min(), particles.positions[:, 0].max()) == (2.0, 3.0)
    corner = particles.tags["right"] & particles.tags["top"]
    np.testing.assert_allclose(particles.area_vectors[corner], [[0.05, 0.05]], rtol=1e-12)


def test_cells_are_whole_where_ghosts_go_on_and_volumes_are_the_shapes() -> None:
    particles = Lattice(on_boundary=True, ghosts=2).particles(Box([1.0, 0.5]), 0.1)
    assert particles.count == 15 * 10
    assert particles.ghosts.sum() == 15 * 10 - 11 * 6
    np.testing.assert_allclose(particles.cells, 0.01, rtol=1e-14)
    np.testing.assert_allclose(particles.volumes[~particles.ghosts].sum(), 0.5, rtol=1e-14)

    some = Lattice(on_boundary=True, ghosts=2, ghost_faces=("left",)).particles(
        Box([1.0, 0.5]), 0.1
    )
    left, right = some.tags["left"], some.tags["right"]
    edge = some.tags["top"] | some.tags["bottom"]
    np.testing.assert_allclose(some.cells[left & ~edge], 0.01, rtol=1e-14)
    np.testing.assert_allclose(some.cells[left & edge], 0.005, rtol=1e-14)
    np.testing.assert_allclose(some.cells[right & edge], 0.0025, rtol=1e-14)
    np.testing.assert_allclose(some.volumes[left & ~edge], 0.005, rtol=1e-14)
    # Ghosts behind one face only, none in the corners that it does not have to itself.
    assert some.ghosts.sum() == 2 * 6
    assert (some.images[some.ghosts, 0] > 0.0).all()


def test_an_unknown_ghost_face_is_refused() -> None:
    with pytest.raises(SceneError, match="has no face 'lft'; it has left"):
        Lattice(ghosts=2, ghost_faces=("lft",)).particles(Box([1.0, 0.5]), 0.1)


def test_spacing_is_changed_to_what_fits() -> None:
    particles = Lattice().particles(Box([1.0, 0.5]), 0.3)
    assert particles.count == 3 * 2
    np.testing.assert_allclose(np.unique(particles.positions[:, 0]), [1 / 6, 1 / 2, 5 / 6])
    np.testing.assert_allclose(np.unique(particles.positions[:, 1]), [0.125, 0.375])
    np.testing.assert_allclose(particles.spacings, math.sqrt(0.25 / 3.0), rtol=1e-14)
    np.testing.assert_allclose(particles.volumes, 0.25 / 3.0, rtol=1e-14)


def test_a_multiple_that_rounding_hides_keeps_the_spacing() -> None:
    particles = Lattice().particles(Interval(0.3), 0.1)  # 0.3 / 0.1 < 3
    assert particles.count == 3
    np.testing.assert_array_equal(particles.spacings, 0.1)


def test_particles_run_along_the_longest_axis_with_ghosts_last() -> None:
    for lengths, fast in ([0.3, 0.2], 0), ([0.2, 0.3], 1), ([0.3, 0.3], 1):
        slow = 1 - fast
        particles = Lattice(ghosts=1).particles(Box(lengths), 0.1)
        real = particles.positions[~particles.ghosts]
        count = round(lengths[fast] / 0.1)
        np.testing.assert_allclose(real[:count, fast], 0.05 + 0.1 * np.arange(count))
        np.testing.assert_allclose(real[:count, slow], 0.05)
        assert not particles.ghosts[: len(real)].any()
        ghosts = particles.positions[particles.ghosts]
        in_order = np.lexsort((ghosts[:, fast], ghosts[:, slow]))
        np.testing.assert_array_equal(in_order, np.arange(len(ghosts)))


def test_symmetric_shapes_have_symmetric_volumes_and_areas() -> None:
    particles = Lattice().particles(Ball(1.0), 0.25)
    for axis in range(3):
        mirrored = particles.positions * np.where(np.arange(3) == axis, -1.0, 1.0)
        gaps = np.linalg.norm(mirrored[:, np.newaxis] - particles.positions[np.newaxis], axis=2)
        image = gaps.argmin(axis=1)
        assert gaps.min(axis=1).max() < 1e-12
        np.testing.assert_allclose(particles.volumes[image], particles.volumes, rtol=1e-9)
        np.testing.assert_allclose(
            np.abs(particles.area_vectors[image]), np.abs(particles.area_vectors), atol=1e-12
        )


def test_volume_of_a_cut_cell_is_the_part_in_the_shape() -> None:
    # A plane across the cells at 0.93 leaves 3/10 of the last column, less than half: it goes to
    # the column before.
    particles = Lattice().particles(Difference(Box([1.0, 0.5]), Box([1.0, 0.5], [0.93, 0.0])), 0.1)
    assert particles.count == 9 * 5
    last = np.isclose(particles.positions[:, 0], 0.85)
    np.testing.assert_allclose(particles.volumes[~last], 0.01, rtol=1e-12)
    np.testing.assert_allclose(particles.volumes[last], 0.013, rtol=1e-12)


def test_no_particle_stays_where_a_difference_has_no_volume() -> None:
    shape = Difference(Box([1.0, 1.0]), Box([0.5, 1.0]))
    particles = Lattice(on_boundary=True).particles(shape, 0.1)
    assert particles.positions[:, 0].min() == pytest.approx(0.5)
    assert particles.count == 6 * 11


# Ghosts ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("on_boundary", [False, True])
def test_ghosts_of_a_flat_face_have_exact_mirror_images(on_boundary: bool) -> None:
    particles = Lattice(on_boundary, ghosts=2).particles(Box([1.0, 0.6, 0.4]), 0.1)
    sides = {"left": (0, 0.0), "right": (0, 1.0), "bottom": (1, 0.0), "back": (2, 0.4)}
    beyond = (particles.positions < -1e-9) | (
        particles.positions > np.array([1.0, 0.6, 0.4]) + 1e-9
    )
    for face, (axis, place) in sides.items():
        ghosts = particles.tags[f"{face}-ghosts"] & (beyond.sum(axis=1) == 1)
        assert ghosts.sum() > 0
        expected = particles.positions[ghosts].copy()
        expected[:, axis] = 2.0 * place - expected[:, axis]
        np.testing.assert_allclose(particles.images[ghosts], expected, atol=1e-14)


@pytest.mark.parametrize("on_boundary", [False, True])
def test_ghosts_beyond_a_corner_are_mirrored_in_every_face(on_boundary: bool) -> None:
    box = Box([1.0, 0.6, 0.4])
    particles = Lattice(on_boundary, ghosts=2).particles(box, 0.1)
    lower, upper = box.bounds()
    expected = particles.positions.copy()
    expected = np.where(expected < lower, 2.0 * lower - expected, expected)
    expected = np.where(expected > upper, 2.0 * upper - expected, expected)
    np.testing.assert_allclose(particles.images, expected, atol=1e-14)


def test_ghosts_of_curved_faces_are_mirrored_to_the_other_side() -> None:
    shape = Annulus(0.5, 1.0)
    particles = Lattice(ghosts=2).particles(shape, 0.05)
    for face, radius in (("inner", 0.5), ("outer", 1.0)):
        ghosts = particles.tagged(f"{face}-ghosts")
        before = np.linalg.norm(particles.positions[ghosts], axis=1)
        after = np.linalg.norm(particles.images[ghosts], axis=1)
        # The mirror is the tangent plane at a sample, up to 1/32 of a spacing along the arc.
        np.testing.assert_allclose(after, 2.0 * radius - before, atol=1e-3)


def test_ghosts_fill_holes_and_reach_so_many_layers() -> None:
    shape = Difference(Box([1.0, 1.0]), Disc(0.3, [0.5, 0.5]))
    for layers in (1, 2):
        particles = Lattice(ghosts=layers).particles(shape, 0.1)
        real = particles.positions[~particles.ghosts]
        # Every point of a larger lattice, by brute force.
        index = np.arange(-4, 14)
        lattice = 0.1 * (
            np.stack(np.meshgrid(index, index, indexing="ij"), -1).reshape(-1, 2) + 0.5
        )
        gaps = np.abs(lattice[:, np.newaxis] - real[np.newaxis]).max(axis=2).min(axis=1)
        expected = lattice[(gaps < (layers + 0.5) * 0.1) & (gaps > 1e-9)]
        np.testing.assert_allclose(particles.positions[particles.ghosts], expected, atol=1e-12)
        assert particles.tags["rim-ghosts"].sum() == (20 if layers == 1 else 32)


def test_images_lie_in_the_shape() -> None:
    for shape in (Box([1.0, 1.0]), Disc(1.0), Ball(1.0), Cylinder(1.0, 1.0), SHAPES[-1]):
        for on_boundary in (False, True):
            particles = Lattice(on_boundary, ghosts=2).particles(shape, 0.125)
            assert (shape.signed_distance(particles.images) <= 1e-9).all(), shape


# Jittered lattice --------------------------------------------------------------------------------


def test_jitter_is_the_seed_and_stays_within_its_amplitude() -> None:
    shape, spacing = Box([1.0, 0.66]), 0.1
    regular = Lattice().particles(shape, spacing)
    one = JitteredLattice(0.3, seed=1).particles(shape, spacing)
    same = JitteredLattice(0.3, seed=1).particles(shape, spacing)
    other = JitteredLattice(0.3, seed=2).particles(shape, spacing)
    np.testing.assert_array_equal(one.positions, same.positions)
    assert (one.positions != other.positions).all()
    moved = (one.positions - regular.positions) / np.array([0.1, 0.66 / 7.0])
    assert np.abs(moved).max() <= 0.3
    # Uniform: the extremes are nearly reached, the variance is that of the distribution.
    assert np.abs(moved).max() > 0.29
    assert moved.std() == pytest.approx(0.3 / math.sqrt(3.0), rel=0.15)
    np.testing.assert_array_equal(one.volumes, regular.volumes)
    np.testing.assert_array_equal(one.area_vectors, regular.area_vectors)


def test_jitter_of_zero_is_the_lattice() -> None:
    jittered = JitteredLattice(0, seed=1, ghosts=2).particles(Disc(1.0), 0.1)
    regular = Lattice(ghosts=2).particles(Disc(1.0), 0.1)
    np.testing.assert_array_equal(jittered.positions, regular.positions)


@pytest.mark.parametrize("seed", range(5))
def test_jitter_keeps_particles_in_curved_shapes(seed: int) -> None:
    shape = Annulus(0.5, 1.0)
    particles = JitteredLattice(0.49, seed, ghosts=1).particles(shape, 0.06)
    real = ~particles.ghosts
    assert (shape.signed_distance(particles.positions[real]) <= 1e-12).all()
    np.testing.assert_array_equal(
        particles.positions[~real],
        Lattice(ghosts=1).particles(shape, 0.06).positions[~real],
    )


# Conforming lattice ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "shape", [Interval(2.0, 0.5), Box([1.0, 0.63], [-3.0, 2.0]), Box([1.0, 0.5, 0.4])], ids=name_of
)
def test_an_aligned_box_has_the_particles_of_the_lattice(shape: Shape) -> None:
    conforming = ConformingLattice().particles(shape, 0.07)
    lattice = Lattice(on_boundary=True).particles(shape, 0.07)
    for field in ("positions", "volumes", "spacings"):
        np.testing.assert_array_equal(getattr(conforming, field), getattr(lattice, field))
    # The samples of a face are added up in another order.
    np.testing.assert_allclose(conforming.area_vectors, lattice.area_vectors, rtol=1e-13)
    assert list(conforming.tags) == list(lattice.tags)
    for name, tag in conforming.tags.items():
        np.testing.assert_array_equal(tag, lattice.tags[name])


@pytest.mark.parametrize("shape", SHAPES, ids=name_of)
@pytest.mark.parametrize("spacing", [0.09, 0.053])
def test_surface_particles_lie_on_the_surface_and_none_beside_another(
    shape: Shape, spacing: float
) -> None:
    particles = ConformingLattice().particles(shape, spacing)
    X, outermost = particles.positions, particles.tags["surface"]
    # Rounding of a distance of about 1.
    assert np.abs(shape.signed_distance(X[outermost])).max() < 1e-14
    # An interior particle's cell is clear of the boundary: half the smallest step of the lattice,
    # which is up to a tenth less than the spacing where this does not divide a side.
    boundary = cKDTree(shape.surface(0.5 * spacing).points)
    assert (boundary.query(X[~outermost])[0] > 0.45 * spacing).all()
    assert cKDTree(X).query(X, k=[2])[0].min() > 0.45 * spacing


@pytest.mark.parametrize("spacing", [0.09, 0.053])
@pytest.mark.parametrize(
    ("shape", "corners"),
    [
        (SHAPES[7], [(0.0, 0.0), (2.0, -1.0), (1.2, 0.0), (2.0, 1.0)]),
        (SHAPES[8], [(1.0, 0.25), (1.0, 0.75), (2.0, 0.25), (0.0, 1.0)]),
        (SHAPES[9], [(0.3, 0.0), (0.0, 0.3), (1.0, 1.0)]),
        # Where a line meets an arc, at (sqrt(0.5^2 - 0.2^2), +-0.2).
        (
            Difference(Box([2.0, 0.4], [0.0, -0.2]), Disc(0.5)),
            [(math.sqrt(0.21), 0.2), (math.sqrt(0.21), -0.2), (2.0, 0.2)],
        ),
        # Two circles cross at x = 0.3, re-entrant: y = +-0.4.
        (Union([Disc(0.5), Disc(0.5, [0.6, 0.0])]), [(0.3, 0.4), (0.3, -0.4)]),
        (
            Difference(Box([1.0, 0.5, 0.4]), Box([0.37, 1.0, 0.21])),
            [(0.37, 0.0, 0.21), (0.0, 0.5, 0.21), (0.37, 0.5, 0.0), (1.0, 0.5, 0.4)],
        ),
    ],
    ids=name_of,
)
def test_every_corner_has_a_particle(
    shape: Shape, corners: list[tuple[float, ...]], spacing: float
) -> None:
    X = ConformingLattice().particles(shape, spacing).positions
    for corner in corners:
        # Samples 1/64 of a spacing apart on an arc of about 5 spacings: tangents there cross
        # (1/128)^2 / 10 spacings beside the corner.
        assert np.linalg.norm(X - corner, axis=1).min() < 1e-5 * spacing


def test_edges_in_space_have_particles() -> None:
    """On the rim where an end of a cylinder meets its side."""
    particles = ConformingLattice().particles(Cylinder(0.5, 1.0, axis="y"), 0.1)
    X = particles.positions
    radius = np.hypot(X[:, 0], X[:, 2])
    for end in (0.0, 1.0):
        # Points of the rim are found some 1/8 of a spacing apart; between two of them a tangent
        # of half that length leaves the rim by (1/16)^2 / 10 spacings.
        on_rim = (np.abs(X[:, 1] - end) < 4e-5) & (np.abs(radius - 0.5) < 4e-5)
        # One for each cell that the circle crosses: between its length and sqrt(2) times it.
        assert 31 <= on_rim.sum() <= 45
        angles = np.sort(np.arctan2(X[on_rim, 2], X[on_rim, 0]))
        assert np.diff(angles, append=angles[0] + 2.0 * np.pi).max() * 0.5 < 0.15


def test_conforming_volumes_are_what_is_nearest() -> None:
    """Against counting on a fine grid, as `points` does it."""
    shape = SHAPES[9]
    particles = ConformingLattice().particles(shape, 0.1)
    fine = 800
    grid_points = (np.indices((fine, fine)).reshape(2, -1).T + 0.5) / fine
    grid_points = grid_points[shape.signed_distance(grid_points) < 0.0]
    owner = cKDTree(particles.positions).query(grid_points)[1]
    counted = np.bincount(owner, minlength=particles.count) / fine**2
    # The last pieces are 1/16 of a cell wide; some 16 of them lie across each border.
    assert np.abs(particles.volumes - counted).max() < 0.02 * 0.1**2


def test_a_circle_of_surface_particles_encloses_its_area() -> None:
    """Surface particles on the surface: their area vectors enclose the body to second order."""
    shape, errors = Disc(0.8, [1.0, 1.0]), []
    for spacing in (0.1, 0.05):
        particles = ConformingLattice().particles(shape, spacing)
        errors.append(abs(enclosed(particles) / shape.volume() - 1.0))
    # A chord of up to 1.5 spacings stays (1.5 s)^2 / 8 R inside of its arc.
    assert errors[0] < 1.5**2 * 0.1**2 / (8.0 * 0.8**2)
    assert errors[1] < 0.5 * errors[0]


# Points ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "shape", [Interval(2.0), Box([1.0, 0.6]), Box([0.5, 0.3, 0.2]), Disc(0.4)], ids=name_of
)
def test_points_on_a_lattice_get_the_volumes_of_the_lattice(shape: Shape) -> None:
    regular = Lattice().particles(shape, 0.1)
    particles = Points(regular.positions).particles(shape, 0.1)
    np.testing.assert_array_equal(particles.positions, regular.positions)
    assert particles.volumes.sum() == pytest.approx(shape.volume(), rel=1e-12)
    # 8 x 8 samples to a cell: some of a cut cell's are on the wrong side.
    tolerance = 1e-12 if isinstance(shape, Box | Interval) else 0.1
    np.testing.assert_allclose(particles.volumes, regular.volumes, rtol=tolerance)
    assert closure(particles) < 1e-12
    for face in regular.faces:
        np.testing.assert_array_equal(particles.tags[face], regular.tags[face])
    np.testing.assert_allclose(particles.area_vectors, regular.area_vectors, atol=1e-12)


def test_scattered_points_share_the_shape_by_nearness() -> None:
    shape = Interval(1.0)
    particles = Points([[0.1], [0.5], [0.6]]).particles(shape, 0.25)
    # Borders at 0.3 and 0.55, to half a sample of 1/256.
    np.testing.assert_allclose(particles.volumes, [0.3, 0.25, 0.45], atol=1 / 512 + 1e-12)
    np.testing.assert_array_equal(particles.tags["left"], [True, False, False])
    np.testing.assert_array_equal(particles.tags["right"], [False, False, True])
    assert not particles.ghosts.any()


def test_given_volumes_are_kept() -> None:
    particles = Points([0.25, 0.75], volumes=[0.4, 0.6]).particles(Interval(1.0), 0.5)
    np.testing.assert_array_equal(particles.volumes, [0.4, 0.6])


@pytest.mark.parametrize("suffix", [".npy", ".csv", ".txt"])
def test_points_are_read_from_files(tmp_path: Path, suffix: str) -> None:
    positions = np.array([[0.25, 0.25], [0.75, 0.25], [0.5, 0.75]])
    path = tmp_path / f"points{suffix}"
    if suffix == ".npy":
        np.save(path, positions)
    else:
        np.savetxt(path, positions, delimiter="," if suffix == ".csv" else " ", header="x y")
    particles = Points(file=path).particles(Box([1.0, 1.0]), 0.5)
    np.testing.assert_array_equal(particles.positions, positions)
    single = tmp_path / "bar.txt"
    single.write_text("0.25\n0.75\n", encoding="utf-8")
    assert Points(file=str(single)).particles(Interval(1.0), 0.5).count == 2


def test_points_do_not_change_with_the_array_they_came_from() -> None:
    given = np.array([[0.25], [0.75]])
    points = Points(given)
    given[0] = np.nan
    first = points.particles(Interval(1.0), 0.5)
    first.positions[0] = np.nan
    assert np.isfinite(points.particles(Interval(1.0), 0.5).positions).all()


# Jittered ----------------------------------------------------------------------------------------

QUARTER = Difference(of=Box([1.0, 1.0]), minus=Disc(0.3))


def test_jittered_moves_what_is_inside_within_the_amplitude_and_nothing_else() -> None:
    regular = ConformingLattice().particles(QUARTER, 0.05)
    one, same, other = (
        Jittered(ConformingLattice(), 0.25, seed).particles(QUARTER, 0.05) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(one.positions, same.positions)
    inside = regular.tags["interior"]
    np.testing.assert_array_equal(one.positions[~inside], regular.positions[~inside])
    assert (one.positions[inside] != other.positions[inside]).all()
    moved = (one.positions - regular.positions)[inside] / regular.spacings[inside, None]
    # Uniform: the extremes are nearly reached, the variance is that of the distribution; 666
    # numbers give it to some 3 per cent.
    assert 0.24 < np.abs(moved).max() <= 0.25
    assert moved.std() == pytest.approx(0.25 / math.sqrt(3.0), rel=0.1)
    for name, tag in regular.tags.items():
        np.testing.assert_array_equal(one.tags[name], tag)
    np.testing.assert_array_equal(one.area_vectors, regular.area_vectors)


def test_jittered_by_nothing_is_what_it_was_given() -> None:
    for arrangement in (ConformingLattice(), Lattice(on_boundary=True)):
        regular = arrangement.particles(QUARTER, 0.1)
        still = Jittered(arrangement, 0.0, seed=1).particles(QUARTER, 0.1)
        np.testing.assert_array_equal(still.positions, regular.positions)
        assert still.volumes.sum() == pytest.approx(regular.volumes.sum(), rel=1e-12)


def test_volumes_of_jittered_particles_follow_them() -> None:
    """In one dimension by hand: cells end half way to the neighbours."""
    particles = Jittered(Lattice(on_boundary=True), 0.4, seed=2).particles(Interval(1.0), 0.1)
    x = np.sort(particles.positions[:, 0])
    borders = np.concatenate([[0.0], 0.5 * (x[1:] + x[:-1]), [1.0]])
    # At most a sample, of which a spacing has dozens, is on the wrong side of either border.
    expected = np.diff(borders)[np.argsort(np.argsort(particles.positions[:, 0]))]
    np.testing.assert_allclose(particles.volumes, expected, atol=0.1 / 32)
    assert np.ptp(particles.volumes[particles.tags["interior"]]) > 0.02


@pytest.mark.parametrize("seed", range(3))
def test_jittered_particles_stay_inside_curved_shapes(seed: int) -> None:
    """Also where those next to the boundary, which own no surface, would cross it."""
    for shape in (QUARTER, Annulus(0.5, 1.0), Ball(0.6)):
        regular = ConformingLattice().particles(shape, 0.11)
        particles = Jittered(ConformingLattice(), 0.49, seed).particles(shape, 0.11)
        inside = particles.tags["interior"]
        assert (particles.positions[inside] != regular.positions[inside]).any(axis=1).all()
        assert (shape.signed_distance(particles.positions[inside]) <= 0.0).all()
        assert (particles.volumes > 0.0).all()


def test_a_jitter_that_would_leave_the_shape_is_halved_until_it_does_not() -> None:
    given = np.array([[0.25], [0.5], [0.75], [0.0]])
    wanted = np.array([[-0.5], [0.25], [1.5], [-0.125]])
    # Halved once to touch the end, not at all, three times; no part of the last stays inside.
    expected = [[0.0], [0.75], [0.9375], [0.0]]
    np.testing.assert_array_equal(moved_inside(Interval(1.0), given, wanted), expected)


# Input -------------------------------------------------------------------------------------------

SQUARE = Box([1.0, 1.0])


def on(
    kind: Callable[..., Discretisation], *args: Any, spacing: Any = 0.5, shape: Shape = SQUARE
) -> Callable[[], Particles]:
    return lambda: kind(*args).particles(shape, spacing)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (on(Lattice, spacing=0.0), "'lattice': spacing must be a positive finite length in m"),
        (on(Lattice, spacing=-1.0), "spacing must be a positive finite length in m, got -1.0"),
        (on(Lattice, spacing=math.nan), "got nan"),
        (on(Lattice, spacing=math.inf), "got inf"),
        (on(Lattice, spacing="small"), "got 'small'"),
        (on(Lattice, spacing=1e-4), r"needs a lattice of 1e\+08 points, .* use a larger spacing"),
        (on(Lattice, spacing=1e-320), "needs a lattice of inf points"),
        (on(Lattice, spacing=9.0, shape=Annulus(1, 2)), "no particle .* use a smaller spacing"),
        (on(Lattice, shape=Difference(Disc(1), Disc(1))), "no particle of the lattice"),
        (on(Lattice, shape=Interval(1e-9, 1e9)), "the shape has no extent"),
        (on(Lattice, "yes"), "on_boundary must be true or false, got 'yes'"),
        (on(Lattice, False, -1), "ghosts must be a whole number of layers, 0 for none, got -1"),
        (on(Lattice, False, 1.5), "ghosts must be a whole number"),
        (on(JitteredLattice, 0.5, 1), r"'jittered-lattice': amplitude must be in \[0, 0.5\) cells"),
        (on(JitteredLattice, math.nan, 1), "amplitude must be in"),
        (on(JitteredLattice, 0.1, -1), "seed must be a whole number"),
        (on(JitteredLattice, 0.1, 1.0), "seed must be a whole number"),
        (on(Jittered, Lattice(), 0.5, 1), r"'jittered': amplitude must be in \[0, 0.5\)"),
        (on(Jittered, Lattice(), 0.1, -1), "'jittered': seed must be a whole number"),
        (on(Jittered, Lattice(ghosts=1), 0.1, 1), "`of` makes 12 ghosts; set its ghosts to 0"),
        (on(JitteredLattice, 0.1, 1, True), "ghosts must be a whole number"),
        (on(Points), "'points': give one of positions and file, got neither"),
        (on(Points, [[0, 0]], "points.txt"), "give one of positions and file, got both"),
        (on(Points, [[0, 0], [1]]), "positions must be numbers in equal rows"),
        (
            on(Points, [[0.1, 0.1, 0.1]]),
            r"rows of 2 coordinates, .* got an array of shape \(1, 3\)",
        ),
        (on(Points, []), r"got an array of shape \(0,\)"),
        (on(Points, [[0.1, 0.1], [math.nan, 0], [math.inf, 0]]), r"row 1 .* not finite: \[nan, 0"),
        (on(Points, [[0.1, 0.1], [2, 0], [3, 0]]), r"point 1 at \[2.0, 0.0\] m .* \(2 of 3"),
        (on(Points, [[0.1, 0], [0.5, 0], [0.5, 1e-8]]), "points 1 and 2 are at the same place"),
        (on(Points, None, "nowhere.csv"), "cannot read positions from 'nowhere.csv'"),
        (on(Points, [[0.1, 0.1]], None, [1.0, 2.0]), "one number for each of the 1 points"),
        (on(Points, [[0.1, 0.1]], None, [-1.0]), "positive and finite, got -1.0 for point 0"),
        (
            on(Points, [[0.5, 0.5], [0.5, 0.5001], [0.5, 0.5002]]),
            "point 1 is too close to others to be given a volume",
        ),
    ],
)
def test_bad_input_is_refused_with_a_remedy(make: Callable[[], Particles], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        make()


@pytest.mark.parametrize(
    ("name", "content"), [("empty.txt", b""), ("words.csv", b"x,y\n"), ("broken.npy", b"none")]
)
def test_unreadable_files_are_refused(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(SceneError, match="cannot read positions from"):
        Points(file=path).particles(SQUARE, 0.5)


def test_one_large_spacing_still_makes_one_particle() -> None:
    particles = Lattice().particles(Box([1.0, 0.5]), 40.0)
    assert particles.count == 1
    np.testing.assert_allclose(particles.volumes, 0.5)
    np.testing.assert_allclose(particles.area_vectors, [[0.0, 0.0]], atol=1e-15)
    assert all(particles.tags[face].all() for face in ("left", "right", "bottom", "top"))


# Where particles end ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arrangement",
    [Fitted(), ConformingLattice(), Jittered(ConformingLattice(), 0.3, 5)],
    ids=name_of,
)
@pytest.mark.parametrize("shape", SHAPES, ids=name_of)
def test_particles_that_own_the_surface_stand_on_it(
    shape: Shape, arrangement: Discretisation
) -> None:
    assert arrangement.ends_on_surface(shape, 0.09)
    particles = arrangement.particles(shape, 0.09)
    outer = particles.tagged("surface")
    assert np.abs(shape.signed_distance(particles.positions[outer])).max() < 1e-6 * 0.09


@given(
    shape=st.sampled_from([Box([1.0, 0.63]), Box([0.6, 0.5, 0.4]), Disc(0.5), Annulus(0.3, 0.6)]),
    depth=st.floats(0.0, 0.5).filter(lambda depth: abs(depth - 0.1) > 1e-3),
)
def test_given_points_end_on_the_surface_up_to_a_tenth_of_a_spacing(
    shape: Shape, depth: float
) -> None:
    """Points of the surface, and one inside, moved inside along its normals."""
    spacing = 0.05
    surface = shape.surface(spacing)
    normals = surface.area_vectors / np.linalg.norm(surface.area_vectors, axis=1)[:, None]
    places = surface.points - depth * spacing * normals
    assert Points(positions=places).ends_on_surface(shape, spacing) is (depth < 0.1)


def test_most_of_the_surface_counts() -> None:
    """Three sides of a square of four, then one."""
    n = np.linspace(0.05, 0.95, 10)
    for count in (3, 1):
        depths = np.where(np.arange(4) < count, 0.0, 0.05)
        sides = [
            np.column_stack([n, np.full(10, depths[0])]),
            np.column_stack([n, np.full(10, 1.0 - depths[1])]),
            np.column_stack([np.full(10, depths[2]), n]),
            np.column_stack([np.full(10, 1.0 - depths[3]), n]),
        ]
        points = Points(positions=np.concatenate(sides))
        assert points.ends_on_surface(Box([1.0, 1.0]), 0.1) is (count == 3)


@pytest.mark.parametrize("kind", [partial(Lattice, on_boundary=True), Fitted, ConformingLattice])
@pytest.mark.parametrize(
    ("lengths", "spacing", "words"),
    [
        ([1.0, 0.5], 1e30, "larger than the shape, of 1 m"),
        ([1.0, 0.5], 125.0, "larger than the shape, of 1 m"),
        ([1.0, 5e-324], 0.1, "no extent"),
        ([1.0, 1e-12], 0.1, "no extent"),
    ],
)
def test_what_no_spacing_fits_is_refused(
    kind: Callable[[], Discretisation], lengths: list[float], spacing: float, words: str
) -> None:
    with pytest.raises(SceneError, match=words):
        kind().particles(Box(lengths), spacing)


@pytest.mark.parametrize("parts", [2, 3])
def test_fitted_particles_stand_on_the_seam_of_a_union(parts: int) -> None:
    """Where the distance is zero inside the body: those of one box."""
    length = 1.2 / parts
    one = Fitted().particles(Box([1.2, 0.6]), 0.1)
    union = Union([Box([length, 0.6], [length * n, 0.0]) for n in range(parts)])
    joined = Fitted().particles(union, 0.1)
    assert joined.positions == pytest.approx(one.positions, abs=1e-12)
