"""A motion whose energies do not add up says so; one whose energies do is left in peace."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidsph import (
    BuildError,
    Record,
    RecordError,
    Scene,
    SceneError,
    Simulation,
    UnsoundError,
    resume,
)
from solidsph.assembly import step_size
from solidsph.run.energy import RESIDUAL
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.watch import Watchdog
from solidsph.watch.hourglass_energy import HourglassEnergy
from tests.helpers.faulty import HalfTheStress
from tests.helpers.scenes import SOFT, box


def column(**control: Any) -> SceneBuilder:
    """A column held at its foot and thrown sideways. Its critical step at rest is half of the CFL
    step, and it gets stiffer as it bends."""
    return (
        Simulation.builder()
        .scheme("corrected")
        .body("column", shape={"type": "box", "lengths": [1.0, 1.0, 6.0]}, spacing=0.25)
        .material("neo-hookean", youngs_modulus=17e6, poissons_ratio=0.45, density=1100.0)
        .formulation("total-lagrangian", gradient="quadratic")
        .boundary("clamp", where="front")
        .effect("hourglass-control", **control)
        .initial(velocity={"x": "10*Z/6"})
        .duration(0.06)
        .outputs(60)
    )


def beyond(record: Record) -> float:
    """The largest residual over the energy at the start, as any reader of the record finds it."""
    start = record.history["kinetic energy [J]"][0] + record.history["strain energy [J]"][0]
    return float(np.abs(record.history[RESIDUAL]).max() / start)


def test_a_column_that_blows_up_is_not_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step_size, "safe_step", lambda *scene: None)
    path = tmp_path / "column.h5"
    with pytest.raises(UnsoundError, match="critical step") as caught:
        column().integrator("velocity-verlet", time_step_factor=0.5).build().run(record=path)
    error = caught.value
    assert error.part > 1.0
    assert 0.0 < error.time < 0.06
    assert error.result is not None
    assert error.result.state.time > error.time
    assert "time_step_factor" in error.remedy
    with Record(path) as record:
        assert record.outcome.startswith("unsound: ")
        assert beyond(record) > 1.0
        assert error.time in record.times
        assert record.times[-1] == error.result.state.time


def test_a_step_that_is_followed_helps() -> None:
    column().build().run()


def plain() -> SceneBuilder:
    """Forces without an energy, at the free ends of a bar."""
    return (
        box(1, 30)
        .formulation("total-lagrangian", gradient="standard", divergence="plain")
        .initial(displacement={"x": "0.05*X"})
        .duration(5e-2)
    )


def updated() -> SceneBuilder:
    """The updated form in tension: neighbours attract each other."""
    return (
        box(1, 30)
        .formulation("updated-lagrangian", gradient="difference", divergence="plain")
        .boundary("clamp", where="left")
        .boundary("prescribed-motion", where="right", displacement={"x": "0.2"})
        .initial(displacement={"x": "0.2*X*(1 + 1e-3*sin(40*X))"})
        .duration(3e-2)
    )


def lying() -> SceneBuilder:
    """A stress that is half of what its energy says."""
    return (
        box(2, 5)
        .material(HalfTheStress(**SOFT))
        .initial(velocity={"x": "2*X"})
        .duration(5e-2)
        .energy_tolerance(0.01)
    )


@pytest.mark.filterwarnings("ignore::solidsph.errors.PartWarning")
@pytest.mark.parametrize(
    ("scene", "cause"),
    [(plain, "Plain"), (updated, "updated Lagrangian"), (lying, "of its energy")],
)
def test_what_else_has_no_energy(scene: Any, cause: str) -> None:
    with pytest.raises(UnsoundError) as caught:
        scene().build().run()
    assert cause in caught.value.cause or scene is lying
    scene().energy_tolerance("off").build().run()
    scene().energy_tolerance(2.0 * caught.value.part).build().run()


def pulled(traction: str) -> SceneBuilder:
    return (
        box(2, 8)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": traction})
        .duration(0.1)
    )


SOUND = {
    "at rest": box(2),
    "at rest under its weight": box(2).effect("body-force", acceleration={"y": 0.0}),
    "a sudden load, which rings": pulled("5e4"),
    "a load that begins slowly": pulled("1e4*t**3"),
    "a load that begins late": pulled("where(t > 0.05, 1e4, 0)"),
    "a flight that is fast beside the waves": box(2).initial(velocity={"x": "1e4 + 1e-3*X"}),
    "the shortest waves": box(2, 8).initial(velocity={"x": "0.5*sin(60*X)*sin(61*Y)"}),
    "hardly any steps": box(2, 5).initial(velocity={"x": "sin(5*X)"}).duration(5e-3),
    "a drag": box(2).effect("mass-damping", rate=50.0).initial(velocity={"x": "X"}),
}


@pytest.mark.parametrize("name", SOUND)
def test_sound_motions_are_left_in_peace(name: str) -> None:
    SOUND[name].engine("matrix").build().run()


def light(traction: float, material: str = "neo-hookean") -> SceneBuilder:
    return pulled(f"{traction}").material(material, **SOFT).engine("matrix")


@pytest.mark.parametrize("material", ["neo-hookean", "saint-venant-kirchhoff", "linear-elastic"])
@pytest.mark.parametrize("traction", [1e-9, 1e-6, 1e-3, 1e-2, 0.1, 1.0])
def test_a_tiny_load_is_sound(traction: float, material: str) -> None:
    """Strain energies are rounded to some 1e-16 of the modulus: more than there is in play."""
    light(traction, material).build().run()


def test_a_block_of_steel_under_its_weight_is_sound() -> None:
    """5 cm strain by 2e-8, and their energy is 1e-15 of the modulus."""
    (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [0.05, 0.05]}, spacing=0.005)
        .material("neo-hookean", youngs_modulus=2e11, poissons_ratio=0.3, density=7800.0)
        .boundary("clamp", where="bottom")
        .effect("body-force", acceleration={"y": -9.81})
        .duration(1e-4)
        .outputs(20)
        .engine("matrix")
        .build()
        .run()
    )


@pytest.mark.filterwarnings("ignore::solidsph.errors.PartWarning")
def test_a_small_load_that_goes_wrong_is_not_sound() -> None:
    """Strains of 1e-5 are no rounding."""
    with pytest.raises(UnsoundError):
        lying().initial(velocity={"x": "1e-3*X"}).build().run()


def test_an_equilibrium_is_not_judged_by_its_path() -> None:
    """One load step is one trapezium, which misses the work of a nonlinear law by much."""
    scene = pulled("4e5").statics(load_steps=1)
    assert "load steps" in scene.build().run().effort
    assert scene.build().run_motion().effort["steps"] > 1


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf, "on", True, None])
def test_a_tolerance_is_a_number_or_off(wrong: Any) -> None:
    with pytest.raises(BuildError, match="energy_tolerance must be a positive number or 'off'"):
        box(2).energy_tolerance(wrong).build()


@pytest.mark.parametrize("wanted", [0.05, "off", 0.01])
def test_the_tolerance_is_a_word_of_the_scene(wanted: Any) -> None:
    scene = box(2).energy_tolerance(wanted).scene()
    assert Scene.from_toml(scene.to_toml()).energy_tolerance == wanted
    assert ("energy_tolerance" in scene.to_toml()) == (wanted != 0.01)
    with pytest.raises(SceneError, match="did you mean 'energy_tolerance'"):
        Scene.from_toml(scene.to_toml().replace("outputs", "energy_tolerence"))


def test_an_unsound_run_is_over(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with pytest.raises(UnsoundError):
        plain().build().run(record=path)
    with Record(path) as record:
        times = record.times.copy()
    with pytest.raises(RecordError, match="is over"):
        resume(path)
    with pytest.raises(UnsoundError):  # going on does not make it sound
        resume(path, until=0.055)
    with Record(path) as record:
        assert np.array_equal(record.times[: len(times)], times)
        assert record.outcome.startswith("unsound")


def test_a_verdict_survives_pickling() -> None:
    error = UnsoundError(time=0.1, part=2.0, tolerance=0.01, cause="this", remedy="that")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.part, again.time) == (str(error), 2.0, 0.1)


def test_watching_passes_over_pairs_once_in_a_thousand_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What a control stores is a pass over all pairs; other looks are at particles alone."""
    looks = []
    look = HourglassEnergy.look

    def counted(self: Any, simulation: Any, observation: Any, accounts: Any) -> Any:
        looks.append(observation.state.step)
        return look(self, simulation, observation, accounts)

    monkeypatch.setattr(HourglassEnergy, "look", counted)
    simulation = box(1, 12).effect("hourglass-control").duration(1.0).outputs(300).build()
    simulation.run(observers=[Watchdog()])
    assert simulation.steps // 1000 <= len(looks) <= simulation.steps // 1000 + 1
    assert looks[-1] == simulation.steps
    assert np.diff(looks[:-1]).min(initial=1000) >= 1000
