"""Which surface a load acts on, and what is reported of it: resultants and moments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import BuildError, Simulation, solve
from solidsph.advice import advise
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SOFT

PRESSED = 1000.0  # Pa
SQUARE = {"type": "box", "lengths": [1.0, 1.0]}
POINTS = [[0.125 + 0.25 * i, 0.125 + 0.25 * j] for i in range(4) for j in range(4)]
LOWER = {"type": "box", "lengths": [1.0, 0.8], "origin": [2.0, 0.0]}


def scene(spacing: float = 0.1, shape: Mapping[str, Any] = SQUARE, **body: Any) -> SceneBuilder:
    return (
        Simulation.builder()
        .scheme("corrected")  # cells, whose faces can be counted
        .body("one", shape=shape, spacing=spacing, **body)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian")
        .duration(1e-2)
    )


def two() -> SceneBuilder:
    return scene().body("plate-2", shape=LOWER, spacing=0.1)


def loaded(builder: SceneBuilder, where: Any, axis: str = "y") -> Array:
    """Total force of a traction of 1 kPa there, (d,) [N]."""
    made = builder.boundary("traction", where=where, traction={axis: PRESSED}).build()
    (load,) = made.dynamics.loads
    return load.forces(0.0, made.initial.positions, made.initial.velocities).sum(axis=0)


def reported(simulation: Simulation) -> dict[str, float]:
    """Everything that is reported of the equilibrium."""
    observation = simulation.dynamics.observe(solve(simulation).state)
    return {k: v for c in simulation.terms for k, v in c.report(observation).items()}


# Ten particles a side, each of which owns 0.1 m of a face: the areas are counted in the comments.
@pytest.mark.parametrize(
    ("where", "metres"),
    [
        ("top", 1.0),
        ("top and X > 0.5", 0.5),  # five particles, and nothing around the corner
        ("X > 0.5 and top", 0.5),
        ("top and not X > 0.5", 0.5),
        ("top and not right", 1.0),  # a piece of the top is on no other face
        ("top or right", 2.0),  # the particle at the corner owns 0.1 m of each
        ("(top or right) and X > 0.5 and Y > 0.5", 1.0),
        ("not left and X > 0.5", 2.0),  # half of the bottom and of the top, and the right
        ("not (left or right)", 2.0),
        ("surface", 4.0),
        ("all", 4.0),
        ("one", 4.0),
        ("one.top", 1.0),
        ("one.top and X > 0.5", 0.5),
        ("one.surface and Y > 0.9 and one.top", 1.0),
        ("Y > 0.9", 1.2),  # no face is named: the ends of the sides belong to it, with a warning
    ],
)
def test_a_load_acts_on_the_faces_that_are_named(where: str, metres: float) -> None:
    # To rounding: faces along the lattice have their exact areas.
    assert loaded(scene(), where) == pytest.approx([0.0, metres * PRESSED], rel=1e-12)


@pytest.mark.parametrize(
    ("where", "metres"),
    [
        ("plate-2 and right", 0.8),
        ("plate_2 and right", 0.8),
        ("plate-2.right", 0.8),
        ("plate_2.right", 0.8),
        ("plate-2.right and Y > 0.4", 0.4),
        ("right and not one", 0.8),
        ("one.right or plate-2.right", 1.8),
        ("right", 1.8),
        ("plate-2.surface", 3.6),
    ],
)
def test_the_face_of_one_body_is_its_own(where: str, metres: float) -> None:
    assert loaded(two(), where, "x") == pytest.approx([metres * PRESSED, 0.0], rel=1e-12)


@pytest.mark.parametrize(
    ("tags", "where", "metres"),
    [
        ({"tip": "top and X > 0.5"}, "tip", 0.5),
        ({"tip": "top and X > 0.5"}, "tip and X < 0.8", 0.3),
        ({"tip": "one.top"}, "one.tip and X > 0.5", 0.5),
        ({"load-end": "not left and Y > 0.5"}, "load-end and right", 0.5),
        ({"corner": "X > 0.9 and Y > 0.9"}, "corner and top", 0.1),
        ({"corner": "X > 0.9 and Y > 0.9"}, "corner", 0.2),
        ({"tip": lambda X: X[:, 0] > 0.5}, "top and tip", 0.5),
    ],
)
def test_a_tag_that_names_a_face_is_of_that_face(
    tags: Mapping[str, Any], where: str, metres: float
) -> None:
    assert loaded(scene(tags=tags), where)[1] == pytest.approx(metres * PRESSED, rel=1e-12)


def test_a_function_of_positions_loads_what_its_particles_own() -> None:
    assert loaded(scene(), lambda X: X[:, 1] > 0.9)[1] == pytest.approx(1200.0, rel=1e-12)


@pytest.mark.parametrize(
    ("builder", "where", "area"),
    [
        (scene(0.1, {"type": "interval", "length": 1.0}), "right and X > 0.5", 1.0),
        # In space a particle owns 0.04 m^2: half of the top, and the strip of it along one edge.
        (scene(0.2, {"type": "box", "lengths": [1.0, 1.0, 1.0]}), "top and X > 0.4", 0.6),
        (scene(0.2, {"type": "box", "lengths": [1.0, 1.0, 1.0]}), "one.top and Z > 0.8", 0.2),
        # Particles on the boundary: six own 0.1 m, the one at the corner half of that.
        (scene(0.1, discretisation={"type": "lattice", "on_boundary": True}), "top and X > 0.35",
         0.65),
        # The seam of a union is no face, and equal names are one.
        (scene(0.1, {"type": "union", "of": [SQUARE, {"type": "box", "lengths": [1.0, 1.0],
         "origin": [1.0, 0.0]}]}), "top and X > 0.5", 1.5),
        # A hole keeps its own names.
        (scene(0.1, {"type": "difference", "of": SQUARE, "minus": {"type": "box",
         "lengths": [0.4, 0.4], "origin": [0.3, 0.3]}}), "hole-top and X > 0.5", 0.2),
        (scene(0.25, discretisation={"type": "points", "positions": POINTS}), "top and X > 0.5",
         0.5),
    ],
    ids=["1D", "3D", "3D edge", "on the boundary", "union", "difference", "points"],
)  # fmt: skip
def test_in_every_dimension_shape_and_discretisation(
    builder: SceneBuilder, where: str, area: float
) -> None:
    total = loaded(builder, where, "x")[0]
    # The samples of a surface stand 1/16 of a spacing apart: where the edge of a hole lies between
    # two, half of one is the error.
    assert total == pytest.approx(area * PRESSED, rel=1e-2 if "hole" in where else 1e-12)


def test_pressure_and_the_smoothed_traction_keep_to_the_face_too() -> None:
    pressed = scene().boundary("pressure", where="top and X > 0.5", pressure=PRESSED).build()
    (load,) = pressed.dynamics.loads
    still = pressed.initial
    assert load.forces(0.0, still.positions, still.velocities).sum(axis=0) == pytest.approx(
        [0.0, -500.0], rel=1e-12, abs=1e-9
    )
    smoothed = (
        scene(discretisation={"type": "lattice", "on_boundary": True, "ghosts": 3})
        .formulation("total-lagrangian", gradient="difference", divergence="plain")
        .boundary("ghost-extension")
        .boundary("approximate-neumann", where="top and X > 0.35", traction={"y": 1.0}, label="n")
        .build()
    )
    (own,) = (c for c in smoothed.terms if c.label == "n")
    report = own.report(smoothed.dynamics.observe(smoothed.initial))
    # The same seven particles as above; at the corner the normal is that of the top alone.
    assert report["n asked resultant y [N]"] == pytest.approx(0.65, rel=1e-12)


def test_everything_else_takes_the_face_of_one_body() -> None:
    held = {"where": "plate-2.left and Y < 0.5", "temperature": 1.0}
    made = (
        two()
        .boundary("clamp", where="one.left")
        .boundary("prescribed-motion", where="plate_2.right and Y > 0.1", displacement={"x": 0.0})
        .effect("body-force", acceleration={"y": -1.0}, where="one.interior")
        .effect("heat", conductivity=1.0, heat_capacity=1.0, held=[held])
        .initial(where="plate-2.top or one.bottom", velocity={"x": 1.0})
        .build()
    )
    X = made.particles.positions
    clamp, motion = made.dynamics.constraints
    assert np.array_equal(clamp.held.any(axis=1), X[:, 0] < 0.1)
    assert np.array_equal(motion.held[:, 0], (X[:, 0] > 2.9) & (X[:, 1] > 0.1))
    upper = (X[:, 0] > 2.0) & (X[:, 1] > 0.7)
    lower = (X[:, 0] < 1.0) & (X[:, 1] < 0.1)
    assert np.array_equal(made.initial.velocities[:, 0] == 1.0, upper | lower)


@pytest.mark.parametrize(
    ("where", "told"),
    [
        ("plate-2.rigth", "body 'plate-2' has no 'rigth'; did you mean 'plate-2.right'? it has "),
        ("plate-2.rigth and X > 0", "did you mean 'plate-2.right'"),
        ("plat-2.right", "there is no body 'plat-2'; did you mean 'plate-2'? bodies: "),
        ("plat.right and Y > 0.1", "there is no body 'plat'"),
        ("plate-2.one", "body 'plate-2' has no 'one'"),
        ("plate-2.right-ghosts", "'right-ghosts' is neither a tag nor a condition"),
        ("top-ghosts and X > 0", "'top-ghosts' is neither a tag nor a condition"),
        ("interior", "no particle at where = 'interior' lies on the surface; name a face"),
        ("top and right", "no surface is on both"),
        ("top and X > 7", "matches no particle"),
    ],
)
def test_a_name_that_is_not_there_is_told(where: str, told: str) -> None:
    with pytest.raises(BuildError) as caught:
        loaded(two(), where)
    (problem,) = caught.value.problems
    assert told in problem


@pytest.mark.parametrize(
    ("where", "tags", "shares"),
    [
        ("Y > 0.9", {}, "1.2 m, is on top 83%, left 8%, right 8%"),
        ("not left and X > 0.5", {}, "2 m, is on right 50%, bottom 25%, top 25%"),
        ("corner", {"corner": "X > 0.9 and Y > 0.9"}, "0.2 m, is on right 50%, top 50%"),
        ("top or X > 0.9", {}, "2.1 m, is on right 48%, top 48%, bottom 5%"),
        (lambda X: X[:, 1] > 0.9, {}, "1.2 m, is on top 83%, left 8%, right 8%"),
        ("top and X > 0.5", {}, None),
        ("(top or right) and X > 0.5", {}, None),
        ("not left", {}, None),
        ("surface", {}, None),
        ("one.top", {}, None),
        ("corner and top", {"corner": "X > 0.9 and Y > 0.9"}, None),
        ("tip", {"tip": "top and X > 0.9"}, None),
        ("top and Y > 0.9", {}, None),
    ],
)
def test_faces_that_are_met_and_not_named_are_told_with_their_shares(
    where: Any, tags: Mapping[str, Any], shares: str | None
) -> None:
    made = scene(tags=tags).boundary("traction", where=where, traction={"y": 1.0}).build()
    told = [one.finding for one in advise(made) if one.name == "several-faces"]
    assert len(told) == (shares is not None)
    assert all(str(shares) in one for one in told)


@pytest.mark.parametrize(
    ("bodies", "tags", "told"),
    [
        (("plate-1", "plate_1"), {}, "body 'plate_1': its name is the same as 'plate-1'"),
        (("one",), {"a-b": "X > 0", "a_b": "X < 9"}, "tag 'a_b' is the same as 'a-b'"),
        (("one", "far-end"), {"far_end": "X > 0"}, "tag 'far_end' is the same as 'far-end'"),
        (("left_ghosts",), {}, "body 'left_ghosts': its name is the same as 'left-ghosts'"),
        (("one",), {"left_ghosts": "X > 0"}, "'left_ghosts' is the same as 'left-ghosts'"),
        (("not",), {}, "body 'not': its name is a keyword of Python"),
        (("one",), {"in": "X > 0"}, "tag 'in' is a keyword of Python"),
        (("one",), {"True": "X > 0"}, "tag 'True' is a keyword of Python"),
        (("is",), {}, "is a keyword of Python"),
        (("one",), {"X": "X > 0"}, "tag 'X' is a variable or constant of formulas"),
        (("pi",), {}, "is a variable or constant of formulas"),
        (("t",), {}, "is a variable or constant of formulas"),
        (("all",), {}, "names a set of particles already"),
    ],
)  # fmt: skip
def test_names_that_no_condition_could_tell_apart_are_refused(
    bodies: tuple[str, ...], tags: Mapping[str, str], told: str
) -> None:
    builder = Simulation.builder().material("neo-hookean", **SOFT).duration(1e-2)
    lattice = {"type": "lattice", "ghosts": 1, "ghost_faces": ["left"]}
    for k, name in enumerate(bodies):
        shape = {"type": "box", "lengths": [1.0, 1.0], "origin": [3.0 * k, 0.0]}
        own = {} if k else tags
        builder = builder.body(name, shape=shape, spacing=0.25, discretisation=lattice, tags=own)
    with pytest.raises(BuildError) as caught:
        builder.boundary("symmetry", axis="x").build()
    problems = [one for one in caught.value.problems if "ghosts (" not in one]
    (problem,) = problems
    assert told in problem


def test_names_of_polygons_edges_and_of_functions() -> None:
    triangle = {"type": "polygon", "vertices": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}
    with pytest.raises(BuildError, match="tag 'edge_0' is the same as 'edge-0'"):
        scene(0.1, triangle, tags={"edge_0": "X > 0.5"}).build()
    # A function is called, and a name is not: the two are told apart.
    named = scene(tags={"max": "X > 0.5", "clip": "X > 0.2"})
    assert loaded(named, "top and max and max(X, Y) > 0.9 and clip")[1] == pytest.approx(500.0)
    # The lower edge, by either way to write it; X-1 is the coordinate less 1 all the same.
    for where in ("edge-0 and a-1", "edge_0 and a_1", "one.edge-0 and a-1", "edge-0 and X-0.5 > 0"):
        edge = scene(0.1, triangle, tags={"a-1": "X > 0.5"})
        assert loaded(edge, where)[1] == pytest.approx(500.0, rel=1e-12)


def test_the_resultant_and_the_moment_of_a_load_are_told_beside_the_traction() -> None:
    made = (
        scene()
        .boundary("clamp", where="left", label="wall")
        .boundary("traction", where="top and X > 0.5", traction={"y": -PRESSED}, label="load")
        .statics()
        .material("neo-hookean", youngs_modulus=1e9, poissons_ratio=0.3, density=1000.0)
        .build()
    )
    report = reported(made)
    assert report["load asked y [Pa]"] == pytest.approx(-1000.0, rel=1e-12)
    assert report["load asked resultant x [N]"] == 0.0
    assert report["load asked resultant y [N]"] == pytest.approx(-500.0, rel=1e-12)
    # 500 N at X = 0.75 m on average; displacements are 1e-6 of the body's size.
    assert report["load asked moment z [N m]"] == pytest.approx(-375.0, rel=1e-5)
    # At rest forces and moments balance, to Newton's tolerance of 1e-9 times many particles.
    assert report["wall reaction x [N]"] == pytest.approx(0.0, abs=1e-5)
    assert report["wall reaction y [N]"] == pytest.approx(500.0, rel=1e-7)
    assert report["wall reaction moment z [N m]"] == pytest.approx(
        -report["load asked moment z [N m]"], rel=1e-7
    )


def test_in_space_a_clamp_tells_the_torque_of_what_it_holds() -> None:
    bar = {"type": "box", "lengths": [2.0, 1.0, 1.0], "origin": [0.0, -0.5, -0.5]}
    made = (
        scene(0.25, bar)
        .material("linear-elastic", youngs_modulus=1e9, poissons_ratio=0.3, density=1000.0)
        .boundary("clamp", where="left", label="wall")
        .boundary("traction", where="right", traction={"y": "-1e3*Z", "z": "1e3*Y"}, label="twist")
        .statics()
        .build()
    )
    report = reported(made)
    # Sum of y^2 + z^2 over a square of four by four: 2 (h^2 - s^2) / 12 times its area.
    torque = 1e3 * 2.0 * (1.0 - 0.25**2) / 12.0
    assert report["twist asked moment x [N m]"] == pytest.approx(torque, rel=1e-5)
    for axis in ("y", "z"):
        assert report[f"twist asked moment {axis} [N m]"] == pytest.approx(0.0, abs=1e-6 * torque)
    assert report["wall reaction moment x [N m]"] == pytest.approx(-torque, rel=1e-5)
    assert report["wall reaction y [N]"] == pytest.approx(0.0, abs=1e-6 * torque)


def test_a_bushing_whose_inner_rim_is_turned_tells_its_torque() -> None:
    """Plane strain between rigid rims: u = (A r + B / r) around, M = 4 pi mu B per thickness.

    Equilibrium of an annulus a < r < b under torsion (Timoshenko & Goodier, Theory of Elasticity):
    the shear stress is M / (2 pi r^2). With u(a) = phi a and u(b) = 0, A = -phi a^2 / (b^2 - a^2)
    and B = -A b^2.
    """
    a, b, phi, E, nu = 0.5, 1.0, 1e-4, 1e6, 0.3
    A = -phi * a**2 / (b**2 - a**2)
    B = -A * b**2
    made = (
        scene(
            0.05,
            {"type": "annulus", "inner_radius": a, "outer_radius": b},
            discretisation="fitted",
        )
        .kernel("cubic-spline", cover=2.6)
        .material("linear-elastic", youngs_modulus=E, poissons_ratio=nu, density=1000.0)
        .formulation("total-lagrangian", gradient="consistent")
        .boundary("clamp", where="outer", label="housing")
        .boundary(
            "prescribed-motion",
            where="inner",
            displacement={"x": f"-{phi}*Y", "y": f"{phi}*X"},
            label="shaft",
        )
        .statics()
        .build()
    )
    report = reported(made)
    moment = 4.0 * np.pi * E / (2.0 * (1.0 + nu)) * B
    # Ten spacings across the wall: 0.06 % off; 1.5 % with the volumes of a conforming lattice.
    assert report["shaft reaction moment z [N m]"] == pytest.approx(moment, rel=0.01)
    assert report["housing reaction moment z [N m]"] == pytest.approx(
        -report["shaft reaction moment z [N m]"], rel=1e-6
    )
    assert abs(report["shaft reaction x [N]"]) < 1e-3 * moment / b


def test_a_pressure_tells_its_resultant_where_it_acts_now() -> None:
    made = scene().boundary("pressure", where="right", pressure=PRESSED, label="push").build()
    moved = made.initial.positions * [1.0, 2.0] + [3.0, 0.0]
    forces = made.dynamics.loads[0].forces(0.0, moved, np.zeros_like(moved))
    # Twice as high, and pressed from the right: 2000 N at y = 1 on average.
    assert forces.sum(axis=0) == pytest.approx([-2000.0, 0.0], abs=1e-9)
    report = reported_at(made, moved)
    assert report["push asked resultant x [N]"] == pytest.approx(-2000.0, rel=1e-12)
    assert report["push asked moment z [N m]"] == pytest.approx(2000.0, rel=1e-12)


def reported_at(simulation: Simulation, positions: Array) -> dict[str, float]:
    state = attrs.evolve(simulation.initial, positions=positions)
    observation = simulation.dynamics.observe(state)
    return {k: v for c in simulation.terms for k, v in c.report(observation).items()}


def test_what_ghosts_hold_is_held() -> None:
    """A quarter between two planes of symmetry, and what only one of them holds."""

    def quarter(**load: Any) -> list[str]:
        lattice = {"type": "lattice", "ghosts": 3, "ghost_faces": ["left"]}
        made = (
            scene(discretisation=lattice)
            .boundary("symmetry", axis="x")
            .boundary("traction", where="right", traction=load)
            .statics()
            .build()
        )
        return [one.finding for one in advise(made) if one.name == "unheld"]

    assert quarter(x=1.0) == []
    (told,) = quarter(y=1.0)  # along the plane nothing holds it
    assert "no equilibrium exists" in told


def test_ghosts_that_only_continue_a_field_hold_nothing() -> None:
    made = (
        scene(discretisation={"type": "lattice", "ghosts": 3, "ghost_faces": ["left"]})
        .boundary("ghost-extension")
        .boundary("traction", where="right", traction={"x": 1.0})
        .statics()
        .build()
    )
    assert "unheld" in {one.name for one in advise(made)}
