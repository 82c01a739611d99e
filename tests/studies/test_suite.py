"""The suite of hard cases: what must come through does, what must not does not."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest

from solidsph import SceneError, Simulation
from solidsph.registry import registry
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph.studies.case_run import run_case
from solidsph.studies.suite import Grade, energy_residual, run_trial, trials
from solidsph.studies.suite_picture import draw_suite
from solidsph_cases.twisting_column import TwistingColumn
from tests.commands.test_cli import solidsph

ALL = list(trials())

# At every change: the first trial of each case, and what must fail or is known to.
SHORT = [
    one
    for number, one in enumerate(ALL)
    if number == 0 or ALL[number - 1][0] != one[0] or one[3].must_fail or one[3].known
]


def named(name: str, label: str) -> tuple[str, str, Case, Trial]:
    (found,) = [one for one in trials([name]) if one[1] == label]
    return found


def told(one: tuple[str, str, Case, Trial]) -> str:
    return f"{one[0]}: {one[1]}"


# The plate takes as long as all others together, these others most of what is left. Cases, or
# single trials of one.
LONG = (
    *("cantilever-plate", "colliding-rings", "crease", "large-stretch", "nonlinear-bar"),
    *("sliding-block", "stiffness-jump", "closing-hole", "folding-strip"),
    "twisting-column: 400 rad/s, nu 0.45",
    *("inflated-ring: beyond the limit load", "notched-sheet: to a stretch of 4, finer"),
)


def is_long(one: tuple[str, str, Case, Trial]) -> bool:
    return one[0] in LONG or told(one) in LONG


@pytest.mark.parametrize(
    "trial",
    [pytest.param(one, marks=pytest.mark.validation if is_long(one) else ()) for one in SHORT],
    ids=told,
)
def test_the_short_form_of_every_case_is_as_expected(
    trial: tuple[str, str, Case, Trial], tmp_path: Path
) -> None:
    verdict = run_trial(*trial, tmp_path, brief=True)
    assert verdict.as_expected, verdict.reason


@pytest.mark.validation
@pytest.mark.parametrize("trial", ALL, ids=told)
def test_every_trial_is_as_expected(trial: tuple[str, str, Case, Trial], tmp_path: Path) -> None:
    verdict = run_trial(*trial, tmp_path)
    print(f"{verdict.grade.value}, {verdict.seconds:.1f} s: {verdict.reason}")
    assert verdict.as_expected, verdict.reason


def test_the_suite_holds_controls_that_must_fail() -> None:
    controls = [trial for *_, trial in ALL if trial.must_fail]
    assert len(controls) >= 5
    assert len(ALL) > 3 * len(controls)
    assert not any(trial.must_fail and trial.known for *_, trial in ALL)


@pytest.mark.parametrize(
    ("name", "label", "words"),
    [
        # What the defaults owe to hourglass control, to the adjoint and to a stable step.
        ("checkerboard", "2D", {"hourglass": 0.0, "gradient": "corrected"}),
        ("free-vibration", "half the critical step", {"of_critical": 1.2, "dimension": 2}),
        ("stretched-bar", "total Lagrangian", {"form": "updated-lagrangian"}),
    ],
)
def test_a_trial_fails_without_what_it_owes_its_stability_to(
    name: str, label: str, words: Mapping[str, Any], tmp_path: Path
) -> None:
    one = named(name, label)
    assert one in SHORT  # so that it is stable with it, as the test of the short forms says
    assert not one[3].must_fail
    assert run_trial(*one, tmp_path, brief=True, settings=words).grade is not Grade.STABLE


@attrs.frozen
class Told(Case):
    """A case whose measurements are made up."""

    title: ClassVar[str] = "made up"
    source: ClassVar[str] = "nothing"
    passes: bool = True
    refused: bool = False

    def scenes(self) -> Mapping[str, Scene]:
        if self.refused:
            raise SceneError("refused for a reason")
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [Measurement("it", 1.0, "m", 2.0, error=0.5, verdict="so so", passed=self.passes)]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        return []


def test_grades_and_their_reasons(tmp_path: Path) -> None:
    good = run_trial("told", "good", Told(), Trial(), tmp_path)
    assert (good.grade, good.reason) == (Grade.STABLE, "it: error 0.5")
    bad = run_trial("told", "bad", Told(), Trial({"passes": False}), tmp_path)
    assert (bad.grade, bad.reason) == (Grade.DEGRADED, "it: 1 m, should be 2 (so so)")
    refused = run_trial("told", "refused", Told(), Trial({"refused": True}), tmp_path)
    assert (refused.grade, refused.reason) == (Grade.FAILED, "refused for a reason")
    assert good.as_expected
    assert not bad.as_expected
    for verdict in (bad, refused):
        assert attrs.evolve(verdict, must_fail="so it must").as_expected
        assert attrs.evolve(verdict, known="so it does").as_expected
    # A control that comes through proves that the suite cannot fail.
    assert not attrs.evolve(good, must_fail="so it must").as_expected
    path = tmp_path / "suite.png"
    draw_suite([good, bad, refused], "made up", path)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_the_command(tmp_path: Path) -> None:
    listed = json.loads(solidsph("stability", "--list", "--json", cwd=tmp_path).stdout)["trials"]
    assert [(row["case"], row["trial"]) for row in listed] == [one[:2] for one in ALL]
    assert {row["expected"] for row in listed} >= {"stable", "fails"}
    brief = solidsph("stability", "inside-out", "stretched-bar", "--brief", cwd=tmp_path)
    assert brief.returncode == 0, brief.stdout
    assert "as expected, including the trials that must fail" in brief.stdout
    assert (tmp_path / "results/stability/suite.png").exists()
    mirrored = json.loads(solidsph("stability", "inside-out", "--json", cwd=tmp_path).stdout)
    assert "turned inside out" in mirrored["trials"][0]["reason"]
    updated = ("--formulation", "updated-lagrangian", "--brief", "--json")
    surprised = solidsph("stability", "stretched-bar", *updated, cwd=tmp_path)
    assert surprised.returncode == 1
    verdict = json.loads(surprised.stdout)["trials"][0]
    assert (verdict["grade"], verdict["as expected"]) == ("failed", False)
    for wrong, message in (
        (("csm1",), "no hard settings"),
        (("stretched-bar", "--map"), "a map is of a scheme"),
        (("--material", "linear-elastic"), "materials and effects of their own"),
    ):
        done = solidsph("stability", *wrong, cwd=tmp_path)
        assert done.returncode == 2
        assert message in done.stderr


def test_only_cases_with_trials_are_in_the_suite() -> None:
    assert {name for name, *_ in ALL} < set(registry.names("cases"))
    with pytest.raises(SceneError, match="no hard settings"):
        list(trials(["csm1"]))


def test_the_residual_is_over_the_energy_in_play(tmp_path: Path) -> None:
    (
        Simulation.builder()
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.1)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .initial(velocity={"x": "0.1*X"})
        .duration(1e-2)
        .build()
        .run(record=tmp_path / "record.h5")
    )
    with Record(tmp_path / "record.h5") as record:
        history = record.history
        energy = history["kinetic energy [J]"] + history["strain energy [J]"]
        expected = np.abs(energy - energy[0]).max() / energy.max()
        assert energy_residual(record) == pytest.approx(expected)


@pytest.mark.validation
def test_the_column_winds_up_by_the_same_angle_at_every_resolution(tmp_path: Path) -> None:
    angles = []
    for across in (6, 12):
        outcome = run_case(TwistingColumn(across=across, duration=0.12), tmp_path)
        assert outcome.passed
        angles += [m.value for m in outcome.measurements if m.quantity.startswith("largest twist")]
        print(f"{across} across: {angles[-1]:.1f} degrees")
    assert angles[0] == pytest.approx(angles[1], rel=0.05)
    assert angles[1] > 300.0
