"""Shapes made of others: turned, drawn out, revolved and named ones, against closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, Scene, Simulation
from solidsph.errors import SceneError
from solidsph.interfaces.shape import Shape
from solidsph.maths.arrays import Array
from solidsph.model.regions import select
from solidsph.registry.construct import construct, describe
from solidsph.testing import conformance
from solidsph_builtin.shapes.annulus import Annulus
from solidsph_builtin.shapes.ball import Ball
from solidsph_builtin.shapes.box import Box
from solidsph_builtin.shapes.cylinder import Cylinder
from solidsph_builtin.shapes.difference import Difference
from solidsph_builtin.shapes.disc import Disc
from solidsph_builtin.shapes.extruded import Extruded
from solidsph_builtin.shapes.named import Named
from solidsph_builtin.shapes.polygon import Polygon
from solidsph_builtin.shapes.revolved import Revolved
from solidsph_builtin.shapes.transformed import Transformed

HOLED = Difference(Box([1.2, 0.8]), {"hole": Disc(0.2, [0.6, 0.4])})
HOUSE = Polygon([(0.2, 0.0), (1.0, 0.0), (1.0, 0.5), (0.6, 0.9), (0.2, 0.5)])


def faces(shape: Shape, spacing: float = 0.05) -> dict[str, float]:
    surface = shape.surface(spacing)
    names, sizes = np.array(surface.faces), np.linalg.norm(surface.area_vectors, axis=1)
    return {name: float(sizes[names == name].sum()) for name in sorted(set(surface.faces))}


def around(shape: Shape, count: int = 2000) -> Array:
    lower, upper = shape.bounds()
    noise = np.random.default_rng(0).uniform(-0.3, 1.3, size=(count, shape.dimension))
    return np.asarray(lower + noise * (upper - lower))


@pytest.mark.parametrize(
    "shape",
    [
        Transformed(Cylinder(0.3, 1.0), 0.5, [30.0, 40.0, 50.0], [1.0, 2.0, 3.0]),
        Extruded(HOLED, 0.5, base=-0.1),
        Revolved(Annulus(0.2, 0.4, [1.0, 0.0]), 90.0),
        Revolved(HOUSE, 250.0),
    ],
    ids=lambda shape: type(shape).__name__,
)
def test_what_every_shape_promises(shape: Shape) -> None:
    assert [one for one in conformance("shapes", shape) if not one.passed] == []


@pytest.mark.parametrize(
    ("made", "same"),
    [
        (Revolved(Disc(0.5, [0.0, 0.2])), Ball(0.5, [0.0, 0.0, 0.2])),
        (Revolved(Box([1.0, 0.7], [-0.5, 0.1])), Cylinder(0.5, 0.7, [0.0, 0.0, 0.1])),
        (Extruded(Disc(0.5, [0.3, 0.0]), 0.7, 0.1), Cylinder(0.5, 0.7, [0.3, 0.0, 0.1])),
        (Extruded(Box([1.0, 0.7]), 0.4), Box([1.0, 0.7, 0.4])),
        (
            Transformed(Cylinder(0.25, 0.35), 2.0, [0.0, 90.0, 0.0], [0.1, 0.2, 0.3]),
            Cylinder(0.5, 0.7, [0.1, 0.2, 0.3], "x"),
        ),
        (Transformed(Box([0.7, 1.0]), rotate=90.0, translate=[1.0, 0.0]), Box([1.0, 0.7])),
    ],
)
def test_bodies_that_have_a_shape_of_their_own(made: Shape, same: Shape) -> None:
    points = around(same)
    assert made.bounds() == (pytest.approx(same.bounds()[0]), pytest.approx(same.bounds()[1]))
    assert made.signed_distance(points) == pytest.approx(same.signed_distance(points), abs=1e-14)
    assert made.convex
    own, other = faces(made), faces(same)
    # A ring of samples in the middle of its part of a curve misses its area by h^2.
    assert sum(own.values()) == pytest.approx(sum(other.values()), rel=1e-4)


def test_a_torus_and_its_parts() -> None:
    """By Pappus; sums of samples miss curves by the square of their distance."""
    whole = Revolved(Disc(0.3, [1.0, 0.0]))
    assert faces(whole)["rim"] == pytest.approx(4.0 * pi**2 * 0.3, rel=1e-4)
    part = faces(Revolved(Disc(0.3, [1.0, 0.0]), 120.0))
    assert part["rim"] == pytest.approx(4.0 * pi**2 * 0.3 / 3.0, rel=1e-4)
    assert part["start"] == pytest.approx(pi * 0.09, rel=1e-12)
    assert part["end"] == pytest.approx(part["start"], rel=1e-14)


def test_a_revolved_polygon_has_the_volume_of_pappus() -> None:
    area, centre = 0.8 * 0.5 + 0.5 * 0.8 * 0.4, 0.6
    assert Revolved(HOUSE).volume() == pytest.approx(2.0 * pi * centre * area, rel=1e-14)


@pytest.mark.parametrize("angle", [60.0, 180.0, 300.0])
def test_what_is_inside_a_part_of_a_turn(angle: float) -> None:
    shape = Revolved(HOUSE, angle)
    points = around(Revolved(HOUSE))
    turn = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 360.0
    flat = np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
    inside = (HOUSE.signed_distance(flat) < 0.0) & (turn < angle)
    assert np.array_equal(shape.signed_distance(points) < 0.0, inside)
    lower, upper = shape.bounds()
    assert np.all(points[inside] > lower)
    assert np.all(points[inside] < upper)


@pytest.mark.parametrize("shape", [Extruded(HOUSE, 0.7, -0.2), Transformed(HOUSE, 2.0, 30.0)])
def test_exact_moments_are_those_of_the_surface(shape: Shape) -> None:
    """By the divergence theorem, from samples whose own size errs by its square."""
    about = np.full(shape.dimension, 0.3)
    found, surface = shape.moments(about), shape.surface(0.02)
    assert found is not None
    x, d = surface.points - about, shape.dimension
    flux = np.sum(x * surface.area_vectors, axis=1)
    assert found.volume == pytest.approx(flux.sum() / d, rel=1e-12)
    assert found.volume == pytest.approx(shape.volume(), rel=1e-14)
    assert found.first == pytest.approx(flux @ x / (d + 1), abs=1e-5)
    second = np.einsum("n,ni,nj->ij", flux, x, x) / (d + 2)
    assert found.second == pytest.approx(second, abs=1e-4)


@pytest.mark.parametrize(
    "shape", [Extruded(HOUSE, 0.7), Revolved(HOUSE), Transformed(HOUSE, 2.0, 30.0, [1.0, 0.0])]
)
def test_nearest_places_are_on_the_boundary_at_that_distance(shape: Shape) -> None:
    points = around(shape)
    near = shape.nearest(points)
    assert near is not None
    assert np.abs(shape.signed_distance(near)).max() < 1e-14
    distances = np.linalg.norm(near - points, axis=1)
    assert distances == pytest.approx(np.abs(shape.signed_distance(points)), abs=1e-14)


def test_turns_are_about_fixed_axes_one_after_the_other() -> None:
    a, b = radians(30.0), radians(40.0)
    shape = Transformed(Box([1e-3, 1e-3, 1.0], [-5e-4, -5e-4, 0.0]), rotate=[30.0, 40.0, 0.0])
    # The z axis turned about x, then about y.
    tip = np.array([cos(a) * sin(b), -sin(a), cos(a) * cos(b)])
    assert shape.signed_distance(0.999 * tip[None])[0] < 0.0
    assert shape.signed_distance(1.003 * tip[None])[0] > 0.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Extruded(Ball(1.0), 1.0), "of must be a plane shape, got one in 3D"),
        (lambda: Revolved(Ball(1.0)), "of must be a plane shape"),
        (lambda: Revolved(Box([1.0, 1.0])), "or its own mirror image in it"),
        (lambda: Revolved(Disc(1.0, [-2.0, 0.0])), "at x > 0, the distance from the axis"),
        (lambda: Revolved(HOUSE, 0.0), "angle must be an angle above 0"),
        (lambda: Transformed(Disc(1.0), rotate=[1.0, 2.0, 3.0]), "rotate must be 1 angle"),
        (lambda: Transformed("disc"), "of must be a shape, got 'disc'"),
        (lambda: Named("a.b", Disc(1.0)), "name must be a word"),
    ],
)
def test_what_is_refused(make: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        make()


# Names -------------------------------------------------------------------------------------------


def table(name: str = "plate") -> Mapping[str, Any]:
    return {
        "type": "difference",
        "of": {name: {"type": "box", "lengths": [1.2, 0.8]}},
        "minus": {
            "hole": {"type": "disc", "radius": 0.2, "centre": [0.6, 0.4]},
            "cut-1": {"type": "box", "lengths": [0.2, 0.2]},
        },
    }


def test_names_of_parts_are_in_those_of_their_faces() -> None:
    shape = construct("shapes", table())
    assert set(faces(shape)) == {
        *(f"plate.{side}" for side in ("left", "right", "bottom", "top")),
        *("hole.rim", "cut-1.right", "cut-1.top"),
    }
    assert construct("shapes", describe("shapes", shape)) == shape
    turned = construct("shapes", {"type": "transformed", "of": table(), "rotate": 20.0})
    assert set(faces(turned)) == set(faces(shape))
    drawn = construct("shapes", {"type": "extruded", "of": {"flat": table()}, "length": 0.5})
    assert "flat.hole-rim" in faces(drawn)


SCENE = """
duration = 1.0
[body.one]
spacing = 0.1
[body.one.shape]
type = "difference"
of = {{{name} = {{type = "box", lengths = [1.2, 0.8]}}}}
minus = {{hole = {{type = "disc", radius = 0.2, centre = [0.6, 0.4]}}}}
[body.one.tags]
upper = "hole.rim and Y > 0.4"
[body.two]
spacing = 0.1
[body.two.shape]
type = "transformed"
translate = [2.0, 0.0]
[body.two.shape.of]
type = "difference"
of = {{type = "box", lengths = [1.2, 0.8]}}
minus = {{hole = {{type = "disc", radius = 0.2, centre = [0.6, 0.4]}}}}
[material]
type = "linear-elastic"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[[boundary]]
type = "pressure"
where = "two.hole.rim and not plate-1.left"
pressure = 10.0
"""


def test_places_by_the_name_of_a_part() -> None:
    particles = (
        Simulation.builder(Scene.from_toml(SCENE.format(name='"plate-1"'))).build().particles
    )
    X = particles.positions
    rims = [np.abs(np.hypot(X[:, 0] - c, X[:, 1] - 0.4) - 0.2) < 1e-9 for c in (0.6, 2.6)]
    assert np.array_equal(select(particles, "hole.rim"), np.flatnonzero(rims[0] | rims[1]))
    assert np.array_equal(select(particles, "two.hole.rim"), np.flatnonzero(rims[1]))
    upper = np.flatnonzero(rims[0] & (X[:, 1] > 0.4))
    assert np.array_equal(select(particles, "upper"), upper)
    assert np.array_equal(select(particles, "one.hole.rim and Y > 0.4"), upper)
    left = select(particles, "plate-1.left")
    assert np.array_equal(left, np.flatnonzero(X[:, 0] == 0.0))
    assert np.array_equal(select(particles, "plate_1.left and X < 1"), left)
    with pytest.raises(SceneError, match=r"has no 'hole\.edge'; it has all, hole\.rim"):
        select(particles, "two.hole.edge and X > 0")


def test_a_body_and_a_part_of_one_name_are_refused() -> None:
    with pytest.raises(
        BuildError, match=r"body 'two': its name is that of a part with .*two\.left"
    ):
        Simulation.builder(Scene.from_toml(SCENE.format(name="two"))).build()
