"""Shapes: distances against brute-force membership, boundaries against closed forms."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array, Mask
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.ball import Ball
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.cylinder import Cylinder
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc
from solidsph_builtin.shapes.extruded import Extruded
from solidsph_builtin.shapes.interval import Interval
from solidsph_builtin.shapes.named import Named
from solidsph_builtin.shapes.polygon import Polygon
from solidsph_builtin.shapes.revolved import Revolved
from solidsph_builtin.shapes.transformed import Transformed
from solidsph_builtin.shapes.union import Union
from tests.helpers.examples import examples

ARROW = [(0.0, 0.0), (2.0, -1.0), (1.2, 0.0), (2.0, 1.0)]

# Shape, volume, total area of its boundary.
CLOSED_FORMS = [
    (Interval(2.5, origin=-1.0), 2.5, 2.0),
    (Box([0.3]), 0.3, 2.0),
    (Box([2.0, 0.7], origin=[1.0, -3.0]), 1.4, 5.4),
    (Box([2.0, 0.7, 0.4], origin=[1.0, -3.0, 5.0]), 0.56, 4.96),
    (Disc(0.8, centre=[3.0, -1.0]), 0.64 * math.pi, 1.6 * math.pi),
    (Annulus(0.5, 0.8, centre=[3.0, -1.0]), 0.39 * math.pi, 2.6 * math.pi),
    (Ball(0.5, centre=[1.0, 2.0, 3.0]), math.pi / 6.0, math.pi),
    (Cylinder(0.5, 2.0, base_centre=[1.0, 2.0, 3.0]), 0.5 * math.pi, 2.5 * math.pi),
    (Cylinder(0.5, 2.0, base_centre=[1.0, 2.0, 3.0], axis="x"), 0.5 * math.pi, 2.5 * math.pi),
    (Cylinder(0.5, 2.0, base_centre=[1.0, 2.0, 3.0], axis="y"), 0.5 * math.pi, 2.5 * math.pi),
    (Polygon(ARROW), 1.2, 2.0 * math.sqrt(5.0) + 2.0 * math.sqrt(1.64)),
    (Polygon(ARROW[::-1]), 1.2, 2.0 * math.sqrt(5.0) + 2.0 * math.sqrt(1.64)),
]


def name_of(value: object) -> str:
    return type(value).__name__ if isinstance(value, Shape) else ""


def areas(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def enclosed(shape: Shape, spacing: float) -> float:
    """Volume by the divergence theorem, from the boundary alone."""
    surface = shape.surface(spacing)
    return float(np.sum(surface.points * surface.area_vectors)) / shape.dimension


@pytest.mark.parametrize(("shape", "volume", "area"), CLOSED_FORMS, ids=name_of)
@pytest.mark.parametrize("spacing", [0.11, 0.043])
def test_boundary_has_the_exact_area_closes_and_encloses_the_volume(
    shape: Shape, volume: float, area: float, spacing: float
) -> None:
    surface = shape.surface(spacing)
    assert shape.volume() == pytest.approx(volume, rel=1e-14)
    assert areas(surface.area_vectors).sum() == pytest.approx(area, rel=1e-12)
    assert np.abs(surface.area_vectors.sum(axis=0)).max() < 1e-13 * area
    assert enclosed(shape, spacing) == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize(("shape", "volume", "area"), CLOSED_FORMS, ids=name_of)
def test_samples_lie_on_the_boundary_and_point_outwards(
    shape: Shape, volume: float, area: float
) -> None:
    spacing = 0.06
    surface = shape.surface(spacing)
    size = areas(surface.area_vectors)
    outwards = 1e-6 * surface.area_vectors / size[:, np.newaxis]
    assert np.abs(shape.signed_distance(surface.points)).max() < 1e-12
    # The gap that a step along the normal opens is the step itself: sign, unit and normal.
    # The flat faces of a cylinder are sampled up to their rim, where an arc bends away.
    ahead = shape.signed_distance(surface.points + outwards)
    behind = shape.signed_distance(surface.points - outwards)
    np.testing.assert_allclose(ahead, 1e-6, rtol=1e-5)
    assert (behind <= 1e-11).all()
    assert np.median(behind) == pytest.approx(-1e-6, rel=1e-5)
    assert len(surface.faces) == len(surface.points)
    if shape.dimension > 1:
        assert size.max() <= spacing ** (shape.dimension - 1)


@pytest.mark.parametrize(
    ("shape", "area_vectors"),
    [
        (Interval(1.0), {"left": [-1.0], "right": [1.0]}),
        (
            Box([2.0, 3.0, 5.0]),
            {
                "left": [-15.0, 0.0, 0.0],
                "right": [15.0, 0.0, 0.0],
                "bottom": [0.0, -10.0, 0.0],
                "top": [0.0, 10.0, 0.0],
                "front": [0.0, 0.0, -6.0],
                "back": [0.0, 0.0, 6.0],
            },
        ),
        (Disc(1.0), {"rim": [0.0, 0.0]}),
        (Annulus(1.0, 2.0), {"inner": [0.0, 0.0], "outer": [0.0, 0.0]}),
        (Ball(1.0), {"surface": [0.0, 0.0, 0.0]}),
        (
            Cylinder(1.0, 2.0, axis="y"),
            {"side": [0.0] * 3, "base": [0.0, -math.pi, 0.0], "end": [0.0, math.pi, 0.0]},
        ),
        (
            Polygon([(0.0, 0.0), (3.0, 0.0), (0.0, 4.0)]),
            {"edge-0": [0.0, -3.0], "edge-1": [4.0, 3.0], "edge-2": [-4.0, 0.0]},
        ),
    ],
    ids=name_of,
)
def test_faces_have_their_names_and_area_vectors(
    shape: Shape, area_vectors: dict[str, list[float]]
) -> None:
    surface = shape.surface(0.3)
    faces = np.array(surface.faces)
    assert set(faces) == set(area_vectors)
    for face, expected in area_vectors.items():
        total = surface.area_vectors[faces == face].sum(axis=0)
        np.testing.assert_allclose(total, expected, atol=1e-12)


@pytest.mark.parametrize("first", [0.0, 0.5], ids=["on the boundary", "centred"])
def test_no_sample_is_as_near_to_two_points_of_an_aligned_lattice(first: float) -> None:
    spacing = 0.1
    points = Box([1.0, 0.6, 0.4]).surface(spacing).points
    from_particle = np.abs((points / spacing - first + 0.5) % 1.0)
    on_face = np.isclose(points / spacing % 1.0, 0.0) | np.isclose(points / spacing % 1.0, 1.0)
    assert (np.minimum(from_particle, 1.0 - from_particle)[~on_face] > 0.05).all()


# Distances ---------------------------------------------------------------------------------------

coordinate = st.floats(-2.0, 2.0)
size = st.floats(0.05, 2.0)


def points_around(shape: Shape, count: int = 200) -> Array:
    lower, upper = shape.bounds()
    margin = 0.3 * (upper - lower)
    noise = np.random.default_rng(7).uniform(size=(count, shape.dimension))
    return np.asarray(lower - margin + noise * (upper - lower + 2.0 * margin))


def winding(vertices: Array, points: Array) -> Mask:
    """Whether each point is inside, from the angle under which it sees the edges go by."""
    to = vertices[np.newaxis] - points[:, np.newaxis]
    after = np.roll(to, -1, axis=1)
    cross = to[..., 0] * after[..., 1] - to[..., 1] * after[..., 0]
    turns = np.arctan2(cross, (to * after).sum(axis=2)).sum(axis=1) / (2.0 * math.pi)
    return np.asarray(np.abs(turns) > 0.5)


@st.composite
def polygons(draw: st.DrawFn) -> Polygon:
    """Star-shaped about 0, so that they never cross themselves, and mostly not convex."""
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(0.3, 2.0), min_size=count, max_size=count))
    turn = draw(st.floats(0.0, 6.0))
    angles = turn + 2.0 * math.pi * np.arange(count) / count
    vertices = np.array(radii)[:, np.newaxis] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return Polygon(vertices[:: draw(st.sampled_from([1, -1]))])


PLANE_SHAPES: st.SearchStrategy[Shape] = st.one_of(
    st.builds(Box, lengths=st.tuples(size, size), origin=st.tuples(coordinate, coordinate)),
    st.builds(Disc, radius=size, centre=st.tuples(coordinate, coordinate)),
    st.builds(
        lambda radius, ratio, centre: Annulus(ratio * radius, radius, centre),
        size,
        st.floats(0.1, 0.9),
        st.tuples(coordinate, coordinate),
    ),
    polygons(),
)


def nested(inner: st.SearchStrategy[Shape]) -> st.SearchStrategy[Shape]:
    several = st.lists(inner, min_size=1, max_size=3).map(tuple)
    return st.one_of(
        st.builds(Union, of=several), st.builds(Difference, of=inner, minus=inner | several)
    )


COMPOSITES = st.recursive(PLANE_SHAPES, nested, max_leaves=6)


def member(shape: Shape, points: Array) -> Mask:
    """Whether each point is inside, from the definition of the shape and nothing else."""
    match shape:
        case Union():
            return np.logical_or.reduce([member(part, points) for part in shape.of])
        case Difference():
            removed = np.logical_or.reduce([member(part, points) for part in shape.minus])
            return member(shape.of, points) & ~removed
        case Polygon():
            return winding(np.array(shape.vertices), points)
        case Box():
            at = (points - np.array(shape.origin)) / np.array(shape.lengths)
            return np.asarray(((at >= 0.0) & (at <= 1.0)).all(axis=1))
        case Disc():
            return np.asarray(areas(points - np.array(shape.centre)) <= shape.radius)
        case Annulus():
            radius = areas(points - np.array(shape.centre))
            return np.asarray((radius >= shape.inner_radius) & (radius <= shape.outer_radius))
        case Ball():
            return np.asarray(areas(points - np.array(shape.centre)) <= shape.radius)
        case Cylinder():
            axis = "xyz".index(shape.axis)
            offset = points - np.array(shape.base_centre)
            across = areas(np.delete(offset, axis, axis=1))
            along = offset[:, axis]
            return (across <= shape.radius) & (along >= 0.0) & (along <= shape.length)
        case Interval():
            x = points[:, 0]
            return np.asarray((x >= shape.origin) & (x <= shape.origin + shape.length))
    raise TypeError(shape)


@examples(150)
@given(COMPOSITES)
def test_sign_of_the_distance_is_membership(shape: Shape) -> None:
    points = points_around(shape)
    distance = shape.signed_distance(points)
    clear = np.abs(distance) > 1e-9
    assert clear.sum() > 100
    np.testing.assert_array_equal((distance < 0.0)[clear], member(shape, points)[clear])


@pytest.mark.parametrize(("shape", "volume", "area"), CLOSED_FORMS, ids=name_of)
def test_sign_of_the_distance_is_membership_in_every_dimension(
    shape: Shape, volume: float, area: float
) -> None:
    points = points_around(shape, 3000)
    np.testing.assert_array_equal(shape.signed_distance(points) <= 0.0, member(shape, points))


@pytest.mark.parametrize(("shape", "volume", "area"), CLOSED_FORMS, ids=name_of)
def test_distance_is_that_to_the_nearest_sample(shape: Shape, volume: float, area: float) -> None:
    points = points_around(shape)
    samples = shape.surface(0.05).points
    gaps = np.linalg.norm(points[:, np.newaxis] - samples[np.newaxis], axis=2).min(axis=1)
    # A sample is nearest to within its own size, at most 0.05 / 4 across in space.
    np.testing.assert_allclose(np.abs(shape.signed_distance(points)), gaps, atol=0.0125)
    assert (np.abs(shape.signed_distance(points)) <= gaps + 1e-12).all()


@examples(60)
@given(COMPOSITES)
def test_distance_never_exceeds_the_way_to_a_point_on_the_other_side(shape: Shape) -> None:
    # Discretisations rely on it: a cell nearer to its centre than that is whole or empty.
    points = points_around(shape)
    distance = shape.signed_distance(points)
    inside, outside = distance < 0.0, distance > 0.0
    gaps = np.linalg.norm(points[inside][:, np.newaxis] - points[outside][np.newaxis], axis=2)
    sums = np.abs(distance[inside])[:, np.newaxis] + np.abs(distance[outside])[np.newaxis]
    assert (sums <= gaps + 1e-12).all()


@examples(50)
@given(st.tuples(size, size), st.tuples(coordinate, coordinate))
def test_a_rectangle_is_the_same_as_box_and_as_polygon(
    lengths: tuple[float, float], origin: tuple[float, float]
) -> None:
    box = Box(lengths, origin)
    (a, b), (c, d) = (corner.tolist() for corner in box.bounds())
    polygon = Polygon([(a, b), (c, b), (c, d), (a, d)])
    points = points_around(box)
    np.testing.assert_allclose(
        box.signed_distance(points), polygon.signed_distance(points), atol=1e-12
    )
    assert polygon.volume() == pytest.approx(box.volume(), rel=1e-9)


@examples(100)
@given(COMPOSITES)
def test_bounds_hold_the_shape(shape: Shape) -> None:
    lower, upper = shape.bounds()
    points = points_around(shape)
    beyond = ((points < lower - 1e-9) | (points > upper + 1e-9)).any(axis=1)
    assert (shape.signed_distance(points)[beyond] > 0.0).all()


# Composites --------------------------------------------------------------------------------------


def faces_of(shape: Shape, spacing: float = 0.05) -> dict[str, float]:
    surface = shape.surface(spacing)
    total: Counter[str] = Counter()
    for face, area in zip(surface.faces, areas(surface.area_vectors).tolist(), strict=True):
        total[face] += area
    return dict(total)


def test_face_shared_by_two_boxes_disappears() -> None:
    shape = Union([Box([1.0, 1.0]), Box([1.0, 1.0], [1.0, 0.0])])
    expected = {"left": 1.0, "right": 1.0, "bottom": 2.0, "top": 2.0}
    assert faces_of(shape) == pytest.approx(expected, rel=1e-12)
    assert enclosed(shape, 0.05) == pytest.approx(2.0, rel=1e-12)


def test_part_of_a_face_shared_by_two_boxes_disappears() -> None:
    shape = Union([Box([1.0, 1.0]), Box([1.0, 0.5], [1.0, 0.25])])
    expected = {"left": 1.0, "right": 1.0, "bottom": 2.0, "top": 2.0}
    assert faces_of(shape) == pytest.approx(expected, rel=1e-12)


def test_face_that_two_overlapping_boxes_have_in_common_counts_once() -> None:
    shape = Union([Box([1.0, 1.0]), Box([1.0, 1.0], [0.5, 0.0])])
    expected = {"left": 1.0, "right": 1.0, "bottom": 1.5, "top": 1.5}
    assert faces_of(shape) == pytest.approx(expected, rel=1e-12)


def test_part_twice_in_a_union_counts_once() -> None:
    assert faces_of(Union([Disc(1.0), Disc(1.0)])) == faces_of(Disc(1.0))


def test_part_inside_another_disappears() -> None:
    assert faces_of(Union([Disc(1.0), Box([0.2, 0.2])])) == faces_of(Disc(1.0))


def test_hole_is_bounded_by_its_rim() -> None:
    shape = Difference(Box([1.0, 1.0]), Disc(0.3, [0.5, 0.5]))
    assert faces_of(shape)["rim"] == pytest.approx(0.6 * math.pi, rel=1e-12)
    assert enclosed(shape, 0.05) == pytest.approx(1.0 - 0.09 * math.pi, rel=1e-12)


def test_notch_opens_the_face_that_it_touches() -> None:
    shape = Difference(Box([1.0, 1.0]), Box([0.5, 0.5], [0.25, 0.0]))
    expected = {
        "left": 1.0,
        "right": 1.0,
        "bottom": 0.5,
        "top": 1.0,
        "hole-left": 0.5,
        "hole-right": 0.5,
        "hole-top": 0.5,
    }
    assert faces_of(shape) == pytest.approx(expected, rel=1e-12)
    assert enclosed(shape, 0.05) == pytest.approx(0.75, rel=1e-12)


def test_removing_what_only_touches_changes_nothing() -> None:
    box = Box([1.0, 1.0])
    assert faces_of(Difference(box, Box([1.0, 1.0], [1.0, 0.0]))) == faces_of(box)


def test_two_holes_may_overlap() -> None:
    holes = (Box([0.4, 0.2], [0.2, 0.4]), Box([0.4, 0.2], [0.4, 0.4]))
    shape = Difference(Box([1.0, 1.0]), holes)
    assert enclosed(shape, 0.05) == pytest.approx(1.0 - 0.6 * 0.2, rel=1e-12)


def test_quarter_of_a_disc_out_of_a_corner() -> None:
    exact = 1.0 - 0.25 * math.pi * 0.3**2
    errors = [
        abs(enclosed(Difference(Box([1.0, 1.0]), Disc(0.3)), spacing) - exact)
        for spacing in (0.07, 0.007)
    ]
    # One sample at each of the two ends of the arc is cut: 1/16 of a spacing long.
    assert errors[0] < 0.07 / 16.0
    assert errors[1] < 0.007 / 16.0


def test_composites_do_not_claim_a_volume() -> None:
    assert Union([Disc(1.0), Disc(1.0)]).volume() is None
    assert Difference(Disc(2.0), Disc(1.0)).volume() is None


# Input -------------------------------------------------------------------------------------------


def test_lists_become_tuples_and_equal_shapes_are_equal() -> None:
    assert Box([1, 2]) == Box((1.0, 2.0), (0.0, 0.0))
    assert hash(Box([1, 2])) == hash(Box((1.0, 2.0)))
    assert Polygon(np.array(ARROW)).vertices == tuple(ARROW)
    assert Difference(Disc(2.0), Disc(1.0)).minus == (Disc(1.0),)


def test_nested_shapes_are_marked_for_the_builder() -> None:
    marked = {
        (kind, field.name)
        for kind in (Union, Difference, Transformed, Extruded, Revolved, Named)
        for field in attrs.fields(kind)
        if field.metadata.get("part") == "shapes"
    }
    of = {(kind, "of") for kind in (Union, Difference, Transformed, Extruded, Revolved, Named)}
    assert marked == of | {(Difference, "minus")}


def make(kind: Callable[..., Shape], *args: Any, **kwargs: Any) -> Callable[[], Shape]:
    return lambda: kind(*args, **kwargs)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (make(Disc, -1.0), "shape 'disc': radius must be a positive finite length in m, got -1.0"),
        (make(Disc, True), "radius must be a positive finite length in m, got True"),
        (make(Disc, 1.0, [0.0, math.nan]), "centre must be a list of 2 finite coordinates in m"),
        (make(Disc, 1.0, [0.0, 0.0, 0.0]), "centre must be a list of 2 finite coordinates"),
        (make(Interval, math.inf), "shape 'interval': length must be a positive finite length"),
        (make(Interval, 1.0, "left"), "origin must be a finite coordinate in m, got 'left'"),
        (make(Box, 5), "lengths must be a list of 1, 2 or 3 positive finite lengths in m, got 5"),
        (make(Box, [1.0, 0.0]), r"got \(1.0, 0.0\)"),
        (make(Box, [1.0] * 4), "shape 'box': lengths must be a list of 1, 2 or 3"),
        (make(Box, [1.0, 2.0], [0.0]), "origin must be a list of 2 coordinates, one for each"),
        (make(Annulus, 2.0, 1.0), "inner_radius must be less than outer_radius = 1.0 m, got 2.0"),
        (make(Ball, 0.0), "shape 'ball': radius must be a positive finite length"),
        (make(Cylinder, 1.0, 1.0, axis="w"), "axis must be 'x', 'y' or 'z', got 'w'"),
        (make(Polygon, [(0, 0), (1, 1)]), "vertices must be a list of at least 3 points"),
        (make(Polygon, [(0, 0), (1, 1), 3]), "vertices must be a list of 2 finite coordinates"),
        (make(Polygon, [(0, 0), (1, 1), (2, 2)]), "around an area greater than zero"),
        (make(Polygon, [(0, 0), (0, 0), (1, 0), (0, 1)]), r"got \(0.0, 0.0\) twice"),
        (make(Polygon, [(0, 0), (3, 1), (2, 0), (0, 2)]), "where edge-0 meets edge-2"),
        (make(Polygon, [(0, 0), (2, 0), (2, 2), (1, 0), (0, 2)]), "where edge-0 meets edge-2"),
        (make(Polygon, [(0, 0), (2, 0), (1, 0), (1, 1)]), "where edge-0 meets edge-1"),
        (make(Union, []), "shape 'union': of must be one or several shapes"),
        (make(Union, ["disc"]), "of must be one or several shapes"),
        (make(Union, [Disc(1.0), Ball(1.0)]), r"shapes of equal dimension, got .*\(2, 3\)"),
        (make(Difference, "disc", Disc(1.0)), "shape 'difference': of must be a shape"),
        (make(Difference, Disc(1.0), []), "minus must be one or several shapes"),
        (make(Difference, Disc(1.0), Ball(1.0)), "minus must be of dimension 2"),
    ],
)
def test_bad_input_is_refused_by_name(build: Callable[[], Shape], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        build()
