"""Scenes as data: TOML in and out, and every mistake one clear message."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import attrs
import pytest

from solidsph import BuildError, Scene, SceneError, Simulation
from solidsph.registry.construct import construct
from solidsph_builtin.kernels.gaussian import Gaussian
from tests.helpers.scenes import SCENE_TOML, box


def problems_of(text: str) -> str:
    """What is said about a scene; the scene must be refused."""
    with pytest.raises((SceneError, BuildError)) as caught:
        Simulation.builder(Scene.from_toml(text)).build()
    return str(caught.value)


def test_toml_round_trip() -> None:
    scene = Scene.from_toml(SCENE_TOML)
    again = Scene.from_toml(scene.to_toml())
    assert again.to_toml() == scene.to_toml()
    assert again.bodies["block"].spacing == 0.125
    assert again.duration == 0.01
    assert again.outputs == 5


def test_builder_and_toml_say_the_same() -> None:
    built = (
        Simulation.builder()
        .title("a block pulled to the right")
        .body("block", shape={"type": "box", "lengths": [1.0, 0.5]}, spacing=0.125)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .formulation("total-lagrangian", gradient="corrected")
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": "1e3*min(t/0.005, 1)"})
        .integrator("central-difference")
        .duration(0.01)
        .outputs(5)
        .scene()
    )
    assert built.to_toml() == Scene.from_toml(SCENE_TOML).to_toml()


def test_a_scene_of_objects_is_written_by_their_registered_names() -> None:
    scene = box(2).kernel(Gaussian(cut=2.5), cover=2.8).scene()
    assert '[kernel]\ntype = "gaussian"\ncut = 2.5\ncover = 2.8' in scene.to_toml()


def test_an_engine_may_be_a_table() -> None:
    scene = Scene.from_toml('engine = {type = "matrix"}\n' + SCENE_TOML)
    assert Scene.from_toml(scene.to_toml()).engine == scene.engine == {"type": "matrix"}
    assert Simulation.builder(scene).build().engine == construct("engines", "matrix")


def test_a_scene_of_functions_runs_but_has_no_file_form() -> None:
    builder = box(2).boundary("clamp", where=lambda X: X[:, 0] < 0.2)
    builder.build()
    with pytest.raises(SceneError, match="cannot be written to a file"):
        builder.scene().to_toml()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        # unknown names, with the nearest match
        ("modified-mollifier", "modified-molifier", "did you mean 'modified-mollifier'"),
        ("neo-hookean", "neo-hokean", "did you mean 'neo-hookean'"),
        ("total-lagrangian", "total-lagrange", "did you mean 'total-lagrangian'"),
        ('"corrected"', '"correct"', "did you mean 'corrected'"),
        ('type = "clamp"', 'type = "clamped"', "did you mean 'clamp'"),
        ("central-difference", "central-diference", "did you mean 'central-difference'"),
        ('type = "box"', 'type = "bix"', "did you mean 'box'"),
        ("outputs = 5", 'engine = "matrx"', "did you mean 'matrix'"),
        ("outputs = 5", "output = 5", "did you mean 'outputs'"),
        ("cover = 3.0", "covr = 3.0", "unknown parameter 'covr'"),
        ("spacing = 0.125", "spacng = 0.125", "did you mean 'spacing'"),
        ("density = 1000.0", "densty = 1000.0", "did you mean 'density'"),
        ('where = "left"', 'where = "lift"', "did you mean 'left'"),
        # missing
        ("density = 1000.0", "", "missing parameter 'density'"),
        ("duration = 0.01", "", "no duration"),
        ("spacing = 0.125", "", "no spacing"),
        ('where = "left"', "", "missing parameter 'where'"),
        ('type = "clamp"', "", "has no `type`"),
        # out of range or of the wrong type
        ("density = 1000.0", "density = -1.0", "density must be positive and finite, got -1.0"),
        ("density = 1000.0", 'density = "heavy"', "density must be a number, got 'heavy'"),
        ("density = 1000.0", "density = true", "density must be a number, got True"),
        ("density = 1000.0", 'density = "1000"', "density must be a number, got '1000'"),
        ("youngs_modulus = 1e6", "youngs_modulus = 1e308", "youngs_modulus must be positive"),
        ("youngs_modulus = 1e6", "youngs_modulus = 1e40", "check the units"),
        ("duration = 0.01", "duration = 1e30", "check the units"),
        ("poissons_ratio = 0.3", "poissons_ratio = 0.5", "incompressible"),
        ("poissons_ratio = 0.3", "poissons_ratio = nan", "between -1 and 0.5"),
        ("duration = 0.01", "duration = -1", "duration must be positive"),
        ("duration = 0.01", "duration = inf", "duration must be finite"),
        ("duration = 0.01", 'duration = "long"', "duration must be a number"),
        ("outputs = 5", "outputs = 0", "outputs must be at least 1"),
        ("outputs = 5", "outputs = 2.5", "outputs must be a whole number"),
        ("spacing = 0.125", "spacing = 0", "spacing"),
        ("spacing = 0.125", "spacing = 1e-6", "at most 5e+07 are allowed"),
        ("lengths = [1.0, 0.5]", "lengths = [1.0, -0.5]", "-0.5"),
        ("lengths = [1.0, 0.5]", "lengths = [1.0, 0.5, 1, 1]", "box"),
        # parts that do not fit each other
        ("cover = 3.0", "cover = 1.4", "cover = 1.4 is too small in 2D"),
        ("cover = 3.0", "cover = 1e9", ""),
        ('type = "central-difference"', 'time_step = 1.0', "exceeds the critical step"),
        ('where = "left"', 'where = "X > 7"', "matches no particle"),
        ('where = "left"', 'where = "X + 1"', "is a number, not a condition"),
        ('where = "left"', 'where = "X < Q"', "unknown name 'Q'"),
        ('where = "right"', 'where = "X < 0.5 and X > 0.2 and Y > 0.15 and Y < 0.35"', "surface"),
        ('where = "left"', "where = 5", "where = 5 must be text"),
        ('where = "left"', "where = []", "where = [] must be text"),
        ('where = "left"', 'where = "left"\naxes = "x"', 'axes must be a list such as ["x"]'),
        ('where = "left"', 'where = "left"\naxes = []', 'axes must be a list such as ["x"]'),
        ("[body.block]", "[body.left]", "names a set of particles already"),
        ("[body.block]", "[body.X]", "is a variable or constant of formulas"),
        ("[body.block]", '[body.""]', "must begin with a letter"),
        ('where = "left"', 'where = "left"\nlabel = "a\\u0000b"', "unprintable"),
        ("traction = {x", "traction = {z", "'z' in a 2D scene"),
        ("traction = {x", "traction = {u", "unknown component 'u'"),
        ("min(t/0.005, 1)", "min(t/0.005)", "min takes 2 arguments"),
        ("min(t/0.005, 1)", "log(-1)", "must be finite"),
        ("min(t/0.005, 1)", "__import__('os')", "not allowed"),
        ('gradient = "corrected"', 'gradient = 3', "expected a name"),
        ('"corrected"', '["corrected"]', "gradient must be one gradient"),
        ('"corrected"', '{type = "corrected", x = 1}', "unknown parameter 'x'"),
        # malformed TOML and wrong structure
        ("[kernel]", "[kernel", "not valid TOML"),
        ("[body.block]", "[[body]]", "body must be a table"),
        ("[[boundary]]\ntype = \"clamp\"", "[boundary]\ntype = \"clamp\"", ""),
        ("[kernel]", "kernel = 3\n[spare]", "unknown key 'spare'"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_clear_message(old: str, new: str, expected: str) -> None:
    assert old in SCENE_TOML
    text = SCENE_TOML.replace(old, new, 1)
    if expected:
        message = problems_of(text)
        assert expected in message
        assert "Traceback" not in message
        return
    # Odd, but either refused by a message or perfectly possible; never another exception.
    with suppress(SceneError, BuildError):
        Simulation.builder(Scene.from_toml(text)).build()


def test_all_problems_are_reported_together() -> None:
    text = (
        SCENE_TOML.replace("neo-hookean", "neo-hokean")
        .replace("cover = 3.0", "cover = -1.0")
        .replace('type = "box"', 'type = "bux"')
        .replace("central-difference", "centrl-difference")
    )
    with pytest.raises(BuildError) as caught:
        Simulation.builder(Scene.from_toml(text)).build()
    assert len(caught.value.problems) == 4
    assert all(problem in str(caught.value) for problem in caught.value.problems)


def test_two_bodies_in_one_place() -> None:
    builder = box(2).body(
        "other", shape={"type": "disc", "radius": 0.3, "centre": [1.1, 0.5]}, spacing=0.1
    )
    with pytest.raises(BuildError, match="'block' and 'other' are in one place"):
        builder.build()


def test_two_bodies_that_touch_are_not_in_one_place() -> None:
    builder = box(2).body(
        "other",
        shape={"type": "box", "lengths": [1.0, 1.0], "origin": [1.0, 0.0]},
        spacing=0.1,
    )
    simulation = builder.build()
    bodies = simulation.model.bodies
    assert [body.name for body in bodies] == ["block", "other"]
    assert simulation.particles.tags["left"].sum() == 6 + 10


def test_bodies_of_different_dimension() -> None:
    builder = box(2).body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.1)
    with pytest.raises(BuildError, match="'block' 2D, 'bar' 1D"):
        builder.build()


def test_two_handlers_for_one_freedom() -> None:
    builder = (
        box(2)
        .boundary("clamp", where="left")
        .boundary("prescribed-motion", where="X < 0.1", displacement={"y": "0.1*t"})
    )
    with pytest.raises(BuildError, match="both determine the motion of 6 particles"):
        builder.build()


def test_two_handlers_for_different_axes_of_one_particle() -> None:
    (
        box(2)
        .boundary("clamp", where="left", axes=["x"])
        .boundary("prescribed-motion", where="X < 0.1", displacement={"y": "0.1*t"})
        .build()
    )


def test_ghosts_that_nobody_moves() -> None:
    builder = box(1, discretisation={"type": "lattice", "ghosts": 3})
    with pytest.raises(BuildError, match=r"6 ghosts \(left-ghosts, right-ghosts\) have no motion"):
        builder.build()


def test_stress_on_ghosts_needs_a_divergence_that_uses_it() -> None:
    builder = (
        box(1, discretisation={"type": "lattice", "ghosts": 3})
        .boundary("ghost-extension")
        .boundary("approximate-neumann", where="left", traction={"x": 1.0}, ghosts="left-ghosts")
    )
    with pytest.raises(BuildError, match="take divergence = 'plain'"):
        builder.build()
    builder.formulation("total-lagrangian", gradient="standard", divergence="plain").build()


def test_nan_in_given_points(tmp_path: Path) -> None:
    points = [[0.25, 0.25], [0.75, float("nan")], [0.25, 0.75], [0.75, 0.75]]
    builder = box(2, discretisation={"type": "points", "positions": points})
    with pytest.raises(BuildError, match="nan"):
        builder.build()


def test_a_missing_scene_file_and_one_that_is_no_text(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="cannot be read"):
        Scene.read(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    with pytest.raises(SceneError, match="cannot be read"):
        Scene.read(tmp_path / "binary.toml")
    with pytest.raises(SceneError, match="cannot be read"):
        Scene.read(tmp_path)


def test_builder_without_anything() -> None:
    with pytest.raises(BuildError, match="no body") as caught:
        Simulation.builder().build()
    assert len(caught.value.problems) == 2


def test_an_equilibrium_needs_no_duration() -> None:
    """Constant loads are the same whatever it is."""
    body = Simulation.builder().body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.1)
    body = body.material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3)
    scene = body.statics().scene()
    text = "\n".join(x for x in scene.to_toml().splitlines() if not x.startswith("duration"))
    assert Scene.from_toml(text) == scene
    assert scene.duration == 1.0


def test_a_part_of_the_wrong_kind() -> None:
    with pytest.raises(BuildError, match="expected a name, a table with a `type`, or a Material"):
        box(2).material(Gaussian()).build()


def test_scene_defaults_can_be_built_from() -> None:
    scene = attrs.evolve(Scene.from_toml(SCENE_TOML), kernel="cubic-spline", cover=2.6)
    simulation = Simulation.builder(scene).build()
    assert {entry.name for entry in simulation.parts} >= {"cubic-spline", "neo-hookean", "box"}
