"""[statics]: a scene found in equilibrium, recorded and told as a motion is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from solidsph import BuildError, ConvergenceError, Record, Scene, SceneError, Simulation, solve
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium
from solidsph.studies.case import Case
from solidsph.studies.case_run import run_case
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML

MOVING = '[integrator]\ntype = "central-difference"\n'
# The load of the moving scene, ten times as high, in three steps.
STATIC_TOML = SCENE_TOML.replace(MOVING, "[statics]\nload_steps = 3\n").replace("1e3*", "1e4*")
# More than the block can carry: dead tractions have a limit point in this law's compression.
CRUSHED_TOML = STATIC_TOML.replace("1e4*", "-1e8*")


def static_scene() -> SceneBuilder:
    return Simulation.builder(Scene.from_toml(STATIC_TOML))


def test_toml_round_trip_and_the_builders_word() -> None:
    scene = Scene.from_toml(STATIC_TOML)
    assert scene.statics is not None
    assert scene.statics.load_steps == 3
    assert "[integrator]" not in scene.to_toml()
    assert Scene.from_toml(scene.to_toml()) == Scene.from_toml(
        Simulation.builder(Scene.from_toml(STATIC_TOML)).statics(load_steps=3).scene().to_toml()
    )
    every = STATIC_TOML.replace("= 3", "= 3\ntolerance = 1e-6\nmax_iterations = 9")
    assert Scene.from_toml(Scene.from_toml(every).to_toml()).statics == (
        static_scene().statics(load_steps=3, tolerance=1e-6, max_iterations=9).scene().statics
    )


def test_it_records_every_load_step_of_the_equilibrium(tmp_path: Path) -> None:
    simulation = static_scene().build()
    result = solve(simulation, record=tmp_path / "record.h5")
    expected = equilibrium(simulation, load_steps=3)
    assert np.array_equal(result.state.positions, expected.state.positions)
    assert result.effort["iterations"] == expected.iterations
    assert result.effort["residual [-]"] < 1e-9
    with Record(tmp_path / "record.h5") as record:
        assert record.outcome == "finished"
        factors = [0.0, *(step.load_factor for step in expected.steps)]
        assert record.times == pytest.approx(0.01 * np.array(factors))
        assert record.steps.tolist() == list(range(len(factors)))
        assert np.array_equal(record.positions[0], simulation.particles.positions)
        assert np.array_equal(record.positions[-1], expected.state.positions)
        assert record.history["strain energy [J]"][-1] > 0.0
        assert not record.history["kinetic energy [J]"].any()
        # The trapezoidal rule is exact for the quadratic part of this small strain's energy.
        work = record.history["work of traction right [J]"][-1]
        assert record.history["energy residual [J]"][-1] == pytest.approx(0.0, abs=1e-3 * work)


def test_what_carries_out_a_scene_is_what_the_scene_says() -> None:
    moving = Simulation.builder(Scene.from_toml(SCENE_TOML)).build()
    assert solve(moving).effort["steps"] == moving.steps
    assert "iterations" in solve(static_scene().build()).effort


def test_no_integrator_counts_as_used() -> None:
    assert not [e for e in static_scene().build().parts if e.kind == "integrators"]
    moving = Simulation.builder(Scene.from_toml(SCENE_TOML)).build()
    assert [e.name for e in moving.parts if e.kind == "integrators"] == ["central-difference"]


@pytest.mark.parametrize(
    ("added", "expected"),
    [
        (MOVING, "statics: an integrator is given"),
        ("[integrator]\ntime_step = 1e-6\n", "statics: a time step is given"),
        ('[[initial]]\nvelocity = {x = "1"}\n', "statics: an initial state is given"),
    ],
)
def test_words_of_a_motion_beside_statics_are_a_problem(added: str, expected: str) -> None:
    with pytest.raises(BuildError, match=expected) as caught:
        Simulation.builder(Scene.from_toml(STATIC_TOML + added)).build()
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("load_steps = 3", "load_step = 3", "did you mean 'load_steps'"),
        ("load_steps = 3", "load_steps = 2.5", "statics.load_steps must be a whole number"),
        (
            "load_steps = 3",
            "load_steps = 0",
            "load_steps must be a whole number of at least 1",
        ),
        (
            "load_steps = 3",
            "max_iterations = 0",
            "max_iterations must be a whole number of at least 1",
        ),
        ("load_steps = 3", "tolerance = 2", "tolerance must lie between 0 and 1, got 2"),
        ("load_steps = 3", 'tolerance = "low"', "statics.tolerance must be a number"),
        ("[statics]\nload_steps = 3", "[[statics]]", "write [statics]"),
    ],
)
def test_a_mistake_is_one_clear_message(old: str, new: str, expected: str) -> None:
    with pytest.raises((SceneError, BuildError)) as caught:
        Simulation.builder(Scene.from_toml(STATIC_TOML.replace(old, new))).build()
    assert expected in str(caught.value)


def test_the_command_line_finds_explains_and_draws_it(tmp_path: Path) -> None:
    (tmp_path / "pull.toml").write_text(STATIC_TOML)
    done = solidsph("run", "pull.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for word in ("iterations", "residual [-]", "wall time [s]"):
        assert word in done.stdout
    assert "step size" not in done.stdout
    assert solidsph("plot", "results/pull/record.h5", cwd=tmp_path).returncode == 0
    facts = json.loads(solidsph("explain", "pull.toml", "--json", cwd=tmp_path).stdout)
    (scene,) = facts["scenes"].values()
    numbers = {row["quantity"]: row["value"] for row in scene["numbers"]}
    assert numbers["free displacements"] == 2 * 40  # of 45 particles, five are clamped
    assert numbers["load steps"] == 3
    assert "time step [s]" not in numbers
    cost = {row["quantity"]: row["value"] for row in scene["cost"]}
    assert cost["predicted wall time [s]"] > 0.0
    work = {row["quantity"]: row["value"] for row in scene["work"]}
    assert work["iterations"] >= 3


def test_failure_is_code_1_with_the_load_steps_up_to_there(tmp_path: Path) -> None:
    (tmp_path / "crush.toml").write_text(CRUSHED_TOML)
    done = solidsph("run", "crush.toml", cwd=tmp_path)
    assert done.returncode == 1
    assert "no equilibrium beyond load factor" in done.stderr
    assert "Traceback" not in done.stderr
    with Record(tmp_path / "results/crush/record.h5") as record:
        assert record.outcome.startswith("ConvergenceError: no equilibrium beyond")
        assert record.count >= 2
        assert 0.0 < record.times[-1] < 0.01


def test_a_case_may_hold_static_scenes_and_outlives_their_failure(tmp_path: Path) -> None:
    class Pulled(Case):
        title, source = "pulled, and crushed", "none"

        def scenes(self):
            return {"pull": Scene.from_toml(STATIC_TOML), "crush": Scene.from_toml(CRUSHED_TOML)}

        def measure(self, records):
            return []

        def draw(self, records, folder):
            return []

    pull, crush = run_case(Pulled(), tmp_path).runs
    assert pull.outcome == "finished"
    assert pull.steps >= 2
    assert crush.outcome.startswith("no equilibrium beyond load factor")
    with pytest.raises(ConvergenceError):
        solve(Simulation.builder(Scene.from_toml(CRUSHED_TOML)).build())
