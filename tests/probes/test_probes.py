"""[[probe]]: measurements that become columns of the history."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import BuildError, Record, Scene, SceneError, Simulation, resume
from solidsph.costs.effect_shares import without
from solidsph.registry import registry
from solidsph.results.output_fields import history
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import example_part
from tests.commands.test_cli import solidsph
from tests.helpers.resuming import Stop, assert_same_record
from tests.helpers.scenes import SCENE_TOML, SOFT, box, touching
from tests.house.test_architecture import modules_after

PROBES_TOML = """
[[probe]]
label = "tip"
quantity = "displacement"
point = [1.0, 0.25]

[[probe]]
label = "middle"
quantity = "stress xx"
line = {from = [0.0, 0.25], to = [1.0, 0.25], count = 11}

[[probe]]
label = "end"
quantity = "velocity magnitude"
where = "right"

[[probe]]
label = "hold"
quantity = "resultant"
account = "clamp left"
about = [0.0, 0.25]

[[probe]]
label = "through"
quantity = "resultant"
where = "right"
"""


def columns(builder: SceneBuilder, moved: Callable[[np.ndarray], Any]) -> dict[str, float]:
    """The history of a scene displaced by a function of X."""
    simulation = builder.build()
    X = simulation.particles.positions
    start = simulation.start()
    state = attrs.evolve(start, positions=X + moved(X), velocities=moved(X))
    terms = (*simulation.terms, *simulation.probes)
    return history(simulation.observe(state), 0.0, terms)


def bent(X: np.ndarray) -> np.ndarray:
    """A small bending about z, with the strain xx = 1e-6 (Y - 1/2)."""
    x, y = X.T
    return 1e-6 * np.stack([x * (y - 0.5), -0.5 * x**2], axis=1)


def linear(cells: int = 6, **body: Any) -> SceneBuilder:
    """A square of a linear law whose gradients see quadratic motions exactly."""
    body = {"discretisation": {"type": "lattice", "on_boundary": True}, **body}
    return (
        box(2, cells, **body)
        .material("linear-elastic", **SOFT)
        .formulation("total-lagrangian", gradient="quadratic")
    )


LAM = SOFT["youngs_modulus"] * 0.3 / (1.3 * 0.4)
MU = SOFT["youngs_modulus"] / 2.6


def test_a_point_has_every_component() -> None:
    found = columns(
        box(2)
        .probe(label="a", quantity="position", point=[1.0, 1.0])
        .probe(label="b", quantity="displacement magnitude", point=[1.0, 1.0])
        .probe(label="c", quantity="deformation-gradient", point=[1.0, 0.0])
        .probe(label="d", quantity="velocity y", point=[1.0, 0.0]),
        lambda X: X @ np.array([[0.1, 0.0], [0.2, 0.3]]),
    )
    expected = {
        "a position x [m]": 1.3,
        "a position y [m]": 1.3,
        "b displacement magnitude [m]": np.hypot(0.3, 0.3),
        "c deformation-gradient xx [-]": 1.1,
        "c deformation-gradient xy [-]": 0.2,
        "c deformation-gradient yx [-]": 0.0,
        "c deformation-gradient yy [-]": 1.3,
        "d velocity y [m/s]": 0.0,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-12)
    assert [name for name in found if name[0] in "abcd" and name[1] == " "] == list(expected)


def test_a_line_has_mean_and_extremes_with_the_place_of_the_maximum() -> None:
    """Across a bent block the stress is linear: zero in the mean, and largest at the top."""
    found = columns(
        linear().probe(
            label="cut", quantity="stress xx", line={"from": [0.5, 0.0], "to": [0.5, 1.0]}
        ),
        bent,
    )
    top = (LAM + 2.0 * MU) * 0.5e-6
    # The motion is quadratic, for which the scheme and the interpolation are exact to rounding of
    # positions, 1e-16 of some 1e-6.
    assert found["cut maximum stress xx [Pa]"] == pytest.approx(top, rel=1e-8)
    assert found["cut minimum stress xx [Pa]"] == pytest.approx(-top, rel=1e-8)
    assert found["cut mean stress xx [Pa]"] == pytest.approx(0.0, abs=1e-8 * top)
    assert found["cut maximum at X [m]"] == 0.5
    assert found["cut maximum at Y [m]"] == 1.0
    assert "cut maximum at Z [m]" not in found


def test_a_face_has_the_mean_over_its_area() -> None:
    found = columns(
        linear()
        .probe(label="end", quantity="displacement x", where="right")
        .probe(label="half", quantity="displacement x", where="right and Y > 0.5"),
        bent,
    )
    assert found["end maximum displacement x [m]"] == pytest.approx(0.5e-6, rel=2e-2)
    # The last sample is half of a sixteenth of a spacing from the corner.
    assert found["end maximum at X [m]"] == 1.0
    assert found["end maximum at Y [m]"] == pytest.approx(1.0 - 1.0 / 32.0 / 6.0)
    assert found["end mean displacement x [m]"] == pytest.approx(0.0, abs=1e-15)
    assert found["half minimum displacement x [m]"] > 0.0
    assert found["half mean displacement x [m]"] == pytest.approx(0.25e-6, rel=0.2)


@pytest.mark.parametrize("d", [2, 3])
def test_a_curved_face_is_where_it_is(d: int) -> None:
    """Every point of a sphere is a radius from its centre."""
    shape = {"type": "disc", "radius": 0.5} if d == 2 else {"type": "ball", "radius": 0.5}
    builder = (
        Simulation.builder()
        .body("block", shape=shape, spacing=0.1)
        .material("neo-hookean", **SOFT)
        .duration(1e-3)
        .probe(label="skin", quantity="position magnitude", where="surface")
    )
    found = columns(builder, lambda X: 0.1 * X)
    for what in ("mean", "minimum", "maximum"):
        assert found[f"skin {what} position magnitude [m]"] == pytest.approx(0.55, rel=1e-3)


SHEARED = 1e-6 * np.array([[1.0, 1.0], [0.0, -2.0]])


def test_stresses_of_plane_strain_count_the_one_across_the_plane() -> None:
    """Hooke's law in three dimensions, written out."""
    names = {"m": "von-mises", "p": "pressure", "l": "principal-stress", "s": "stress xy"}
    builder = linear()
    for label, quantity in names.items():
        builder.probe(label=label, quantity=quantity, point=[0.5, 1.0])
    found = columns(builder, lambda X: X @ SHEARED.T)
    strain = np.zeros((3, 3))
    strain[:2, :2] = 0.5 * (SHEARED + SHEARED.T)
    stress = LAM * np.trace(strain) * np.eye(3) + 2.0 * MU * strain
    a, b, c = np.diag(stress)
    mises = np.sqrt(0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) + 3.0 * stress[0, 1] ** 2)
    expected = {
        "m von-mises [Pa]": mises,
        "p pressure [Pa]": -(a + b + c) / 3.0,
        "l principal-stress [Pa]": 0.5 * (a + b) + np.hypot(0.5 * (a - b), stress[0, 1]),
        "s stress xy [Pa]": stress[0, 1],
    }
    # The Cauchy stress of the linear law is P F^T / J: it differs by the strain, 1e-6.
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-5)


# A law that could not be evaluated in three dimensions would have to be refused: all built in can.
@pytest.mark.parametrize("material", registry.names("materials"))
@pytest.mark.parametrize("d", [1, 2])
def test_every_material_has_in_few_dimensions_the_stress_of_three(material: str, d: int) -> None:
    """The same motion, some of it beyond yield, of a bar or a plate and of a block."""
    motion = {"x": "0.03*min(t/1e-3, 1)*X", **({"y": "0.01*t/1e-3*X"} if d == 2 else {})}
    still = dict.fromkeys("xyz", 0.0)
    found = []
    for dimension in (d, 3):
        simulation = (
            box(dimension, 4)
            .material(example_part("materials", material))
            .boundary(
                "prescribed-motion",
                where="all",
                displacement=dict(list({**still, **motion}.items())[:dimension]),
            )
            .probe(label="p", quantity="von-mises", point=[0.5] * dimension)
            .probe(label="q", quantity="pressure", point=[0.5] * dimension)
            .duration(1e-3)
            .energy_tolerance("off")
            .build()
        )
        observation = simulation.observe(simulation.run().state)
        found.append([n for term in simulation.probes for n in term.report(observation).values()])
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert found[0][0] > 0.0


def test_a_material_of_the_plane_alone_is_refused() -> None:
    hooke = type(example_part("materials", "linear-elastic"))

    def in_the_plane(F: Any, params: Any) -> Any:
        P = hooke.first_piola(F, params)
        return P if len(F) < 3 else tuple(tuple(2.0 * x for x in row) for row in P)

    @attrs.frozen
    class Plane(registry.interface("materials")):
        density = 1000.0
        params = lame_parameters = (LAM, MU)
        energy = staticmethod(hooke.energy)
        tangent = staticmethod(hooke.tangent)
        first_piola = staticmethod(in_the_plane)

    scene = linear().material(Plane()).probe(label="p", quantity="pressure", point=[0.5, 0.5])
    with pytest.raises(BuildError, match="probe 'p': body 'block': the stress across the plane"):
        scene.build()


def cantilever(length: float = 0.5, force: float = 1.0) -> SceneBuilder:
    """A beam of height 0.1 that a small force bends, in equilibrium."""
    return (
        Simulation.builder()
        .body(
            "beam",
            shape={"type": "box", "lengths": [length, 0.1]},
            spacing=0.0125,
            discretisation={"type": "fitted-moments", "of": "conforming-lattice"},
        )
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian", gradient="consistent")
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": -force / 0.1}, label="weight")
        .duration(1.0)
        .statics()
    )


@pytest.mark.parametrize("force", [0.01, 200.0])
def test_the_moment_of_a_clamp_is_that_of_statics(force: float, tmp_path: Path) -> None:
    length = 0.5
    simulation = (
        cantilever(length, force)
        .probe(label="root", quantity="resultant", account="clamp left", about=[0.0, 0.05])
        .probe(label="load", quantity="resultant", account="weight", about=[0.0, 0.05])
        .probe(label="end", quantity="displacement x", point=[length, 0.05])
        .build()
    )
    final = simulation.run(record=tmp_path / "record.h5").final
    # The tolerance of the equilibrium is 1e-9.
    assert final["root force y [N]"] == pytest.approx(force, rel=1e-8)
    # A large force has moved towards the clamp with the end of the beam, of which the particles
    # turn about the middle.
    arm = length + final["end displacement x [m]"]
    assert final["root moment z [N m]"] == pytest.approx(force * arm, rel=1e-4)
    assert final["load moment z [N m]"] == pytest.approx(-force * arm, rel=1e-4)
    bends = force > 1.0
    assert (arm < 0.99 * length) == bends
    if not bends:
        assert final["root moment z [N m]"] == pytest.approx(force * length, rel=1e-8)


def test_the_bending_stress_is_largest_at_the_root_above(tmp_path: Path) -> None:
    length, force = 0.5, 0.01
    simulation = (
        cantilever(length, force)
        .probe(
            label="fibre",
            quantity="stress xx",
            line={"from": [0.1, 0.1], "to": [length, 0.1], "count": 41},
        )
        .probe(
            label="section",
            quantity="stress xy",
            line={"from": [0.25, 0.0], "to": [0.25, 0.1], "count": 41},
        )
        .build()
    )
    final = simulation.run(record=tmp_path / "record.h5").final
    # Bernoulli's M h / (2 I) at x = 0.1, a height away from the clamp; measured: 0.14 % more.
    peak = force * (length - 0.1) * 0.05 / (0.1**3 / 12.0)
    assert final["fibre maximum stress xx [Pa]"] == pytest.approx(peak, rel=0.005)
    assert final["fibre maximum at X [m]"] == 0.1
    assert final["fibre maximum at Y [m]"] == 0.1
    # Its mean is half of the maximum, since it falls to zero at the end.
    assert final["fibre mean stress xx [Pa]"] == pytest.approx(0.5 * peak, rel=0.005)
    # Jourawski's parabola carries the force, -3/2 of its mean at the centre; measured: 0.9 % and
    # 2.5 % less.
    assert final["section mean stress xy [Pa]"] == pytest.approx(-force / 0.1, rel=0.02)
    assert final["section minimum stress xy [Pa]"] == pytest.approx(-1.5 * force / 0.1, rel=0.05)


def test_the_resultant_through_a_face_is_that_of_its_stress() -> None:
    """Of a uniform stress: its area times P N, at the middle of the face; none through all."""
    found = columns(
        linear()
        .probe(label="end", quantity="resultant", where="right")
        .probe(label="end'", quantity="resultant", where="right", about=[1.0, 0.5])
        .probe(label="all", quantity="resultant", where="surface"),
        lambda X: X @ SHEARED.T,
    )
    xx, xy = LAM * -1e-6 + 2.0 * MU * 1e-6, MU * 1e-6
    assert found["end force x [N]"] == pytest.approx(xx, rel=1e-8)
    assert found["end force y [N]"] == pytest.approx(xy, rel=1e-8)
    assert found["end moment z [N m]"] == pytest.approx(xy - 0.5 * xx, rel=1e-5)
    assert found["end' moment z [N m]"] == pytest.approx(0.0, abs=1e-5 * xx)
    for name in ("force x [N]", "force y [N]", "moment z [N m]"):
        assert found[f"all {name}"] == pytest.approx(0.0, abs=1e-5 * xx)


@pytest.mark.parametrize("d", [1, 3])
def test_moments_are_about_each_axis_there_is(d: int) -> None:
    about = [0.5, 0.25, 1.0][:d]
    simulation = (
        box(d, 4)
        .effect("body-force", acceleration={"x": 1.0})
        .probe(label="w", quantity="resultant", account="body-force", about=about)
        .build()
    )
    found = simulation.probes[0].report(simulation.observe(simulation.start()))
    expected = {"w force x [N]": 1000.0}
    if d == 3:
        expected |= {"w force y [N]": 0.0, "w force z [N]": 0.0}
        # c = (1/2, 1/2, 1/2) of the block, (c - about) x (1000, 0, 0).
        expected |= {"w moment x [N m]": 0.0, "w moment y [N m]": -500.0}
        expected |= {"w moment z [N m]": -250.0}
    assert found == pytest.approx(expected, abs=1e-9)


def test_an_account_of_an_effect_that_is_taken_away_is_zero() -> None:
    """As receipts do, to see what an effect changes."""
    simulation = (
        box(2, 4)
        .effect("mass-damping", rate=30.0)
        .probe(label="w", quantity="resultant", account="mass-damping")
        .initial(velocity={"x": 1.0})
        .build()
    )
    with_it, less = (
        one.probes[0].report(one.observe(one.start()))
        for one in (simulation, without(simulation, "mass-damping"))
    )
    assert with_it["w force x [N]"] == pytest.approx(-30.0 * 1000.0)
    assert not any(less.values())


def test_toml_round_trip_and_the_builders_words() -> None:
    scene = Scene.from_toml(SCENE_TOML + PROBES_TOML)
    assert Scene.from_toml(scene.to_toml()).probes == scene.probes
    builder = Simulation.builder(Scene.from_toml(SCENE_TOML))
    builder.probe(label="tip", quantity="displacement", point=[1.0, 0.25])
    line = {"from": [0.0, 0.25], "to": [1.0, 0.25], "count": 11}
    builder.probe(label="middle", quantity="stress xx", line=line)
    builder.probe(label="end", quantity="velocity magnitude", where="right")
    builder.probe(label="hold", quantity="resultant", account="clamp left", about=[0.0, 0.25])
    builder.probe(label="through", quantity="resultant", where="right")
    assert builder.scene().probes == scene.probes


def test_they_are_columns_of_every_output_and_survive_a_stop(tmp_path: Path) -> None:
    simulation = Simulation.builder(Scene.from_toml(SCENE_TOML + PROBES_TOML)).build()
    whole, stopped = tmp_path / "whole.h5", tmp_path / "stopped.h5"
    result = simulation.run(record=whole)
    with pytest.raises(KeyboardInterrupt):
        simulation.run(record=stopped, observers=[Stop(3)])
    resume(stopped)
    assert_same_record(whole, stopped)
    with Record(whole) as record:
        moved = record.history["tip displacement x [m]"]
        assert moved[0] == 0.0
        assert moved[-1] == result.final["tip displacement x [m]"]
        assert record.history_units["hold moment z [N m]"] == "N m"
        assert moved == pytest.approx(
            [record.at([1.0, 0.25], output).displacement[0, 0] for output in range(record.count)],
            rel=1e-13,
        )
        # What the clamp reports itself, about the origin.
        shifted = record.history["hold moment z [N m]"] - 0.25 * record.history["hold force x [N]"]
        reported = record.history["clamp left reaction moment z [N m]"]
        assert shifted == pytest.approx(reported, abs=1e-9 * np.abs(reported).max())


WRONG = """
[[probe]]
label = "a"
quantity = "strss xx"
point = [0.5, 0.25]

[[probe]]
label = "b"
quantity = "displacement"
point = [1.5, 0.25]

[[probe]]
label = "c"
quantity = "stress"
where = "right"

[[probe]]
label = "d"
quantity = "resultant"
account = "clamp lefft"

[[probe]]
label = "e"
quantity = "velocity w"
point = [0.5, 0.25]

[[probe]]
label = "f"
quantity = "pressure"
where = "rigth"

[[probe]]
quantity = "pressure"
point = [0.5, 0.25]
"""


def test_all_mistakes_are_reported_together() -> None:
    text = SCENE_TOML.replace('type = "neo-hookean"', 'type = "neo-hookian"') + WRONG
    with pytest.raises(BuildError) as caught:
        Simulation.builder(Scene.from_toml(text)).build()
    for expected in (
        "'neo-hookian'",
        "probe 'a': there is no quantity 'strss'; did you mean 'stress'?",
        "probe 'b': the point [1.5, 0.25] lies outside of body 'block', at least 0.5 m",
        "probe 'c': a maximum is of one number, and 'stress' has several; choose a component",
        "probe 'e': 'velocity' has no component 'w' in 3D; it has x, y, z, magnitude",
        "probe 'f': where = 'rigth' is neither a tag nor a condition; did you mean 'right'?",
        "a probe has no label",
    ):
        assert any(expected in problem for problem in caught.value.problems), expected
    # Accounts are known once the other mistakes are mended.
    with pytest.raises(BuildError, match="no account 'clamp lefft'; did you mean 'clamp left'"):
        Simulation.builder(Scene.from_toml(SCENE_TOML + WRONG.split("\n\n")[3])).build()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({}, "no quantity; add quantity = "),
        ({"quantity": 3, "point": [0.5, 0.5]}, "quantity must be text, got 3"),
        ({"quantity": "stress"}, "give one of point, line, where for 'stress', got none"),
        ({"quantity": "stress", "point": [0, 0], "where": "top"}, "got point and where"),
        ({"quantity": "stress", "account": "x"}, "give one of point, line, where for"),
        ({"quantity": "resultant", "point": [0, 0]}, "give one of where, account for"),
        ({"quantity": "stress xz", "point": [0.0, 0.0]}, "no component 'xz' in 2D; it has xx, xy"),
        ({"quantity": "pressure x", "point": [0.0, 0.0]}, "no component 'x' in 3D; it is one numb"),
        ({"quantity": "stress", "point": "tip"}, r"point must be a list of coordinates .* 'tip'"),
        ({"quantity": "stress", "point": [0.0, True]}, "point must be a list of coordinates"),
        ({"quantity": "stress", "point": [0.0, float("inf")]}, "point must be a list of coord"),
        ({"quantity": "stress", "point": [0.5]}, r"\(m, 2\) in metres, finite, got"),
        ({"quantity": "pressure", "line": [[0, 0], [1, 1]]}, "line must be a table such as"),
        ({"quantity": "pressure", "line": {"from": [0], "to": [0]}}, "line must join two points"),
        (
            {"quantity": "pressure", "line": {"from": [0, 0], "to": [1, 1], "count": 1}},
            "count must be a whole number from 2",
        ),
        (
            {"quantity": "pressure", "line": {"from": [0, 0], "to": [1, 1], "number": 9}},
            "unknown key 'number'",
        ),
        (
            {"quantity": "pressure", "line": {"from": [0, 0], "to": [2, 2]}},
            r"the point \[2.0, 2.0\], and 49 more points, lies outside",
        ),
        ({"quantity": "stress", "point": [0, 0], "about": [0, 0]}, "point of a moment; leave it"),
        ({"quantity": "pressure", "where": "top", "body": "block"}, "body belongs to a point"),
        ({"quantity": "stress", "point": [0, 0], "body": "blok"}, "there is no body 'blok'"),
        ({"quantity": "resultant", "where": "top", "about": [0.0]}, "must have 2 coordinates"),
        ({"quantity": "pressure", "where": "interior"}, "lies on the surface; name a face"),
    ],
)
def test_mistakes_say_what_to_do(words: dict[str, Any], message: str) -> None:
    builder = box(2).probe(label="p", quantity=words.pop("quantity", None), **words)
    with pytest.raises(BuildError, match=message) as caught:
        builder.build()
    assert all(problem.startswith("probe 'p': ") for problem in caught.value.problems)


def test_a_label_names_one_probe_and_no_column_twice() -> None:
    twice = box(2)
    for _ in range(2):
        twice.probe(label="p", quantity="stress", point=[0.5, 0.5])
    with pytest.raises(BuildError, match="two probes are labelled 'p'"):
        twice.build()
    clash = box(2).boundary("clamp", where="left", label="a")
    clash.probe(label="a reaction", quantity="resultant", account="a")
    with pytest.raises(BuildError, match=r"'a' and 'a reaction' would both give .* column"):
        clash.build()
    with pytest.raises(SceneError, match="unknown key 'pint'; did you mean 'point'"):
        Scene.from_toml(SCENE_TOML + PROBES_TOML.replace("point =", "pint ="))


def test_bodies_that_touch_have_points_of_their_own() -> None:
    found = columns(
        touching(2)
        .probe(label="one", quantity="displacement x", point=[1.0, 0.5], body="block")
        .probe(label="two", quantity="displacement x", point=[1.0, 0.5], body="other"),
        lambda X: np.where(X[:, :1] < 1.0, [0.25, 0.0], 0.0),
    )
    assert found["one displacement x [m]"] == pytest.approx(0.25)
    assert found["two displacement x [m]"] == pytest.approx(0.0, abs=1e-14)


def test_explain_lists_them(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE_TOML + PROBES_TOML)
    done = solidsph("explain", "scene.toml", "--json", cwd=tmp_path)
    (facts,) = json.loads(done.stdout)["scenes"].values()
    assert [(row["probe"], row["at"]) for row in facts["probes"]] == [
        ("tip", "point [1.0, 0.25]"),
        ("middle", "line from [0.0, 0.25] to [1.0, 0.25] count 11"),
        ("end", "where right"),
        ("hold", "account clamp left, about [0.0, 0.25]"),
        ("through", "where right"),
    ]


def test_nothing_of_probes_is_loaded_without_one() -> None:
    run = "from solidsph import Scene, Simulation\nscene = Scene.from_toml({!r})\n"
    run += "Simulation.builder(scene).build().run()"
    without, with_some = (
        {name for name in modules_after(run.format(text)) if "probes" in name}
        for text in (SCENE_TOML, SCENE_TOML + PROBES_TOML)
    )
    assert without == set()
    assert "solidsph.probes.words" in with_some
