"""The watchdog: it sees what goes wrong, names it, leaves what is needed, and can go back."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import attrs
import numpy as np
import pytest

from solidsph import DivergedError, Record, RecordError, Simulation, UnsoundError, resume
from solidsph.results import checkpointer
from solidsph.results.checkpoint import checkpoint_path, read_checkpoint
from solidsph.run.accounts import Accounts
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.watch import Grade, Symptom, Watchdog, run_watched
from solidsph.watch.collapsing_neighbours import CollapsingNeighbours
from solidsph.watch.faster_than_sound import FasterThanSound
from solidsph.watch.hourglass_energy import HourglassEnergy
from solidsph.watch.passing_through import PassingThrough
from solidsph.watch.symptom import Finding
from solidsph.watch.vanishing_volume import VanishingVolume
from tests.helpers.resuming import OFTEN, Stop, assert_same_record
from tests.helpers.scenes import SCENE_TOML, SOFT, box
from tests.helpers.waiting import HANG

# Confined wave speed of the soft block: sqrt((lambda + 2 mu) / rho) by its constants.
_MU = 1e6 / 2.6
SPEED = float(np.sqrt((2.0 * _MU * 0.3 / 0.4 + 2.0 * _MU) / 1000.0))


def found(
    symptom: Symptom,
    builder: SceneBuilder,
    *,
    displacements: np.ndarray | None = None,
    velocities: np.ndarray | None = None,
    accounts: Accounts | None = None,
) -> Finding | None:
    """What a symptom says to one state of a scene."""
    simulation = builder.build()
    state = simulation.start()
    X = simulation.particles.positions
    u = np.zeros_like(X) if displacements is None else displacements
    v = np.zeros_like(X) if velocities is None else velocities
    state = attrs.evolve(state, positions=X + u, velocities=v)
    observation = simulation.dynamics.observe(state)
    if accounts is None:
        accounts = Accounts()
        accounts.add(observation)
    return symptom.look(simulation, observation, accounts)


def moved(builder: SceneBuilder, particle: int, by: float) -> np.ndarray:
    u = np.zeros_like(builder.build().particles.positions)
    u[particle, 0] = by
    return u


def test_a_body_at_rest_has_no_symptom() -> None:
    for symptom in (
        VanishingVolume(),
        FasterThanSound(),
        CollapsingNeighbours(),
        HourglassEnergy(),
    ):
        assert found(symptom, box(2).effect("hourglass-control")) is None, symptom


def test_volume() -> None:
    """A bar squeezed uniformly has J = 1 - k wherever its supports are complete."""
    bar = box(1, 20)
    X = bar.build().particles.positions
    assert found(VanishingVolume(), bar, displacements=-0.7 * X) is None
    squeezed = found(VanishingVolume(0.2), bar, displacements=-0.9 * X)
    assert squeezed.grade is Grade.WARNING
    turned = found(VanishingVolume(0.2), bar, displacements=-1.1 * X)
    assert turned.grade is Grade.FAILURE
    broken = np.zeros_like(X)
    broken[7] = np.nan
    assert found(VanishingVolume(), bar, displacements=broken).grade is Grade.FAILURE


@pytest.mark.parametrize(
    ("part", "grade"), [(0.4, None), (0.6, Grade.WARNING), (1.1, Grade.FAILURE), (np.nan, "no")]
)
def test_speed_is_against_the_body(part: float, grade: object) -> None:
    plate = box(2, 10)
    v = np.full_like(plate.build().particles.positions, 1e3)  # all of it flies
    v[33, 1] += part * SPEED * 100 / 99  # of a hundred, whose mean moves by a hundredth
    finding = found(FasterThanSound(), plate, velocities=v)
    if grade is None:
        assert finding is None
    elif grade == "no":
        assert finding.grade is Grade.FAILURE
    else:
        assert (finding.grade, finding.particle) == (grade, 33)
        assert f"{part:.3g} of the wave speed" in finding.cause


@pytest.mark.parametrize(
    ("left", "grade"), [(0.2, None), (0.1, Grade.WARNING), (0.01, Grade.FAILURE)]
)
def test_neighbours(left: float, grade: Grade | None) -> None:
    bar = box(1, 20)
    finding = found(CollapsingNeighbours(), bar, displacements=moved(bar, 6, (1.0 - left) * 0.05))
    assert (finding and finding.grade) == grade
    if finding:
        assert finding.particle == 6
        assert f"come to {left:.3g}" in finding.cause


@pytest.mark.parametrize(
    ("form", "remedy"), [("total", "hourglass-control"), ("updated", "the total Lagrangian form")]
)
def test_neighbours_are_helped_by_what_the_scene_lacks(form: str, remedy: str) -> None:
    bar = box(1, 20).formulation(f"{form}-lagrangian")
    finding = found(CollapsingNeighbours(), bar, displacements=moved(bar, 6, 0.99 * 0.05))
    assert finding.remedy.startswith(remedy)


def test_hourglass_share() -> None:
    """A zigzag, which the gradient of a lattice hardly sees."""
    bar = box(1, 20).effect("hourglass-control")
    zigzag = 1e-4 * (-1.0) ** np.arange(20)[:, None]
    finding = found(HourglassEnergy(), bar, displacements=zigzag)
    # The ends of the bar see it, so that the strain energy is not nothing.
    assert finding.grade is Grade.WARNING
    assert found(HourglassEnergy(failure=0.2), bar, displacements=zigzag).grade is Grade.FAILURE
    X = bar.build().particles.positions
    assert found(HourglassEnergy(), bar, displacements=0.01 * X) is None


def rolled(turns: float, **effects: dict[str, object]) -> tuple[SceneBuilder, np.ndarray]:
    """A strip, 41 particles by 3, bent to an arc of so many turns."""
    shape = {"type": "box", "lengths": [2.0, 0.1], "origin": [-1.0, -0.05]}
    builder = (
        Simulation.builder()
        .body("strip", shape=shape, spacing=0.05)
        .material("neo-hookean", **SOFT)
        .duration(1e-2)
    )
    for name, words in effects.items():
        builder = builder.effect(name.replace("_", "-"), **words)
    X = builder.build().particles.positions
    radius = 2.0 / (2.0 * np.pi * turns)
    angle, r = X[:, 0] / radius, radius - X[:, 1]
    return builder, np.stack([r * np.sin(angle), radius - r * np.cos(angle)], axis=1) - X


def test_a_body_that_passes_through_itself() -> None:
    """A strip rolled up by a turn and a bit lies in itself; one by less, or with contact, does not.
    Pressed to a tenth it is crushed, and does not."""
    weight: dict[str, object] = {"acceleration": {"y": -9.81}}
    builder, u = rolled(1.2, body_force=weight)
    finding = found(PassingThrough(), builder, displacements=u)
    assert finding is not None
    assert finding.grade is Grade.WARNING
    assert finding.remedy == "the effect 'contact' with itself = ['strip']"
    builder, u = rolled(0.9, body_force=weight)
    assert found(PassingThrough(), builder, displacements=u) is None
    builder, u = rolled(1.2, contact={"itself": ["strip"]})
    assert found(PassingThrough(), builder, displacements=u) is None
    crushed = u * 0.0
    crushed[:, 0] = -0.9 * builder.build().particles.positions[:, 0]
    builder, _ = rolled(0.9)
    assert found(PassingThrough(), builder, displacements=crushed) is None


# Runs


def crushed() -> SceneBuilder:
    """A wall drives into a bar, faster and faster, in the end faster than sound."""
    return (
        box(1, 20)
        .boundary("prescribed-motion", where="left", displacement={"x": "1500*t**2"})
        .boundary("clamp", where="right")
        .duration(0.05)
        .outputs(1000)
    )


class Fails(Symptom):
    """A failure of every run whose step is above a limit, at a time; a warning before."""

    def __init__(self, step: float, time: float, warned: float = 0.0) -> None:
        self._step, self._time, self._warned = step, time, warned

    def look(self, simulation, observation, accounts) -> Finding | None:
        time = observation.state.time
        if simulation.step_size <= self._step or time < self._time - self._warned:
            return None
        grade = Grade.FAILURE if time >= self._time else Grade.WARNING
        return Finding(grade, 3, "it was told to", "nothing")


def wobbling() -> Simulation:
    return (
        box(2)
        .initial(velocity={"x": "3*sin(2*X)"})
        .effect("mass-damping", rate=20.0)
        .integrator("central-difference")
        .outputs(6)
        .duration(0.02)
        .build()
    )


def test_a_failure_is_named_and_leaves_what_is_needed(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    simulation = wobbling()
    with pytest.raises(DivergedError) as caught:
        run_watched(simulation, record=path, symptoms=[Fails(0.0, 0.009)])
    error = caught.value
    assert (error.particle, error.cause, error.remedy) == (3, "it was told to", "nothing")
    assert "it was told to at particle 3" in str(error)
    assert str(error).endswith("Try nothing")
    assert (tmp_path / "run-watchdog.png").stat().st_size > 10_000
    with Record(path) as record:
        assert record.outcome == f"diverged: {error}"
        assert record.times[-1] == error.time  # the output that failed is there to be seen
        # The checkpoint is of the one before.
        assert read_checkpoint(checkpoint_path(path)).state.time == record.times[-2]


def test_a_run_that_finds_out_for_itself_is_told_more(tmp_path: Path) -> None:
    """J turns over before the watchdog hears of it; what it saw before is said."""
    path = tmp_path / "run.h5"
    with pytest.raises(DivergedError) as plain:
        crushed().build().run(record=path)
    early = VanishingVolume(0.9)
    with pytest.raises(DivergedError) as caught:
        run_watched(crushed().build(), record=path, symptoms=[early])
    assert caught.value.step == plain.value.step
    assert "(before, at t = " in caught.value.cause
    assert "the volume vanishes" in str(caught.value)
    assert (tmp_path / "run-watchdog.png").exists()


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_a_picture_of_any_dimension(tmp_path: Path, dimension: int) -> None:
    simulation = box(dimension, 4).initial(velocity={"x": "sin(2*X)"}).outputs(2).build()
    with pytest.raises(DivergedError):
        run_watched(simulation, record=tmp_path / "run.h5", symptoms=[Fails(0.0, 1e-3)])
    assert (tmp_path / "run-watchdog.png").exists()


def test_a_picture_of_positions_that_are_no_numbers(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    builder = box(2).effect("body-force", acceleration={"x": "1e200*t"}).outputs(2)
    with pytest.raises(DivergedError, match=r"not finite|volume"):
        run_watched(builder.build(), record=path)
    assert (tmp_path / "run-watchdog.png").exists()


def test_watching_changes_no_bit(tmp_path: Path) -> None:
    one, other = tmp_path / "one.h5", tmp_path / "other.h5"
    wobbling().run(record=one)
    run_watched(wobbling(), record=other)
    assert_same_record(one, other)


def test_going_back_halves_the_step(tmp_path: Path) -> None:
    """Twice, after which the run is one of a quarter of the step from where it went back to."""
    path = tmp_path / "run.h5"
    simulation = wobbling()
    coarse = simulation.step_size
    # It fails at 0.015 s and warns 0.007 s before: what is sound ends before 0.008 s.
    symptoms = [Fails(0.3 * coarse, 0.015, warned=0.007)]
    result = run_watched(simulation, record=path, roll_backs=2, symptoms=symptoms)
    plain = tmp_path / "plain.h5"
    simulation.run(record=plain)
    with Record(path) as record, Record(plain) as other:
        assert len(record.notes) == 2
        assert record.notes[0].startswith("rolled back from t = 0.0")
        assert f"halved to {coarse / 4.0:.9g} s: it was told to at particle 3" in record.notes[1]
        assert record.outcome == "finished"
        # The same outputs, up to rounding of the time; the first of them to the bit.
        assert record.times == pytest.approx(other.times, rel=1e-12)
        sound = int(np.sum(record.times < 0.008))
        assert 1 < sound < record.count
        assert np.array_equal(record.positions[:sound], other.positions[:sound])
        assert record.steps[sound:] == pytest.approx(4 * other.steps[sound:])
        # The error of a second order scheme: close to the other, but not the same.
        apart = np.abs(record.positions[-1] - other.positions[-1]).max()
        way = np.abs(other.positions[-1] - other.positions[0]).max()
        assert 0.0 < apart < 0.02 * way
        # Energy is accounted for across the break.
        energy = record.history["kinetic energy [J]"] + record.history["strain energy [J]"]
        residual = record.history["energy residual [J]"]
        assert np.abs(residual).max() < 1.2 * np.abs(other.history["energy residual [J]"]).max()
        assert energy[0] > 0.0
    assert result.effort["step size [s]"] == coarse / 4.0


def test_a_run_that_went_back_is_resumed_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpointer, "SHARE", OFTEN)
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    simulation = wobbling()
    symptoms = [Fails(0.6 * simulation.step_size, 0.009)]
    run_watched(simulation, record=whole, roll_backs=1, symptoms=symptoms)
    stop = Stop(6)  # three outputs, the one that fails, and two more
    with pytest.raises(KeyboardInterrupt):
        run_watched(simulation, record=path, roll_backs=1, symptoms=symptoms, observers=[stop])
    resume(path)
    assert_same_record(whole, path)


def test_a_failure_from_the_first_output_on_starts_anew(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    simulation = wobbling()
    symptoms = [Fails(0.6 * simulation.step_size, 0.0)]
    run_watched(simulation, record=path, roll_backs=1, symptoms=symptoms)
    simulation.halved().run(record=tmp_path / "fine.h5")
    with Record(path) as record, Record(tmp_path / "fine.h5") as fine:
        assert np.array_equal(record.positions[:], fine.positions[:])
        assert record.steps.tolist() == fine.steps.tolist()
        assert "to t = 0 s" in record.notes[0]


def test_there_is_an_end_to_going_back(tmp_path: Path) -> None:
    with pytest.raises(DivergedError):
        run_watched(
            wobbling(), record=tmp_path / "run.h5", roll_backs=2, symptoms=[Fails(0.0, 0.009)]
        )
    with Record(tmp_path / "run.h5") as record:
        assert len(record.notes) == 2


def test_what_it_knows_survives_an_interruption(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpointer, "SHARE", OFTEN)
    whole, first, second = Watchdog(), Watchdog(), Watchdog()
    simulation, path = wobbling(), tmp_path / "run.h5"
    simulation.run(observers=[whole])
    with pytest.raises(KeyboardInterrupt):
        simulation.run(record=path, observers=[first, Stop(4)])
    resume(path, simulation=simulation, observers=[second])
    kept: list[dict[str, np.ndarray]] = [{}, {}]
    whole.solidsph_keep(kept[0])
    second.solidsph_keep(kept[1])
    assert np.array_equal(kept[0]["watchdog accounts"], kept[1]["watchdog accounts"])
    assert np.all(kept[0]["watchdog accounts"] != 0.0)


def test_a_growing_residual_stops_a_run(tmp_path: Path) -> None:
    """A gradient that is not symmetric, with a force that has no energy: waves grow."""
    simulation = (
        Simulation.builder()
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.02)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian", gradient="skewed", divergence="plain")
        .initial(velocity={"x": "1e-3*exp(-((X-0.5)/0.05)**2)"})
        .duration(0.5)
        .outputs(100)
        .build()
    )
    with pytest.raises(UnsoundError, match="do not add up"):
        run_watched(simulation, record=tmp_path / "run.h5")


def test_the_command(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE_TOML.replace("1e3*min(t/0.005, 1)", "1e9*t"))
    solidsph = str(Path(sys.executable).with_name("solidsph"))

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [solidsph, "run", *words, "--output", str(tmp_path / "out")],
            capture_output=True,
            text=True,
            check=False,
            timeout=HANG,
        )

    done = run(str(scene), "--watch", "--roll-back", "1")
    assert done.returncode == 1
    assert "watchdog, failure at t = " in done.stderr or "diverged" in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "out/record-watchdog.png").exists()
    for words in (["upwinding", "--watch"], [str(scene), "--no-watch", "--roll-back", "1"]):
        refused = run(*words)
        assert refused.returncode == 2
        assert refused.stderr.startswith("error: --")


def test_a_watchdog_needs_a_record_that_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError):
        run_watched(wobbling(), record=tmp_path / "file" / "run.h5")
