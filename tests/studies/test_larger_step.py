"""What the largest safe time step would give, measured for the configurations of a front."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path

import pytest

from solidsph.scene.scene_data import DEFAULT_FACTOR
from solidsph.studies.case import Case
from solidsph.studies.cost import SweepSetup, frontier
from solidsph.studies.frontier import Frontier
from solidsph.studies.larger_step import (
    ERROR,
    LARGEST,
    TIME,
    LargerStep,
    at_largest_step,
    larger_step_sentence,
)
from solidsph.studies.point import Point
from solidsph.studies.report import write_report
from solidsph.studies.runner import Inline
from solidsph.studies.variant import with_settings
from solidsph_cases.csm1 import Csm1
from solidsph_cases.graded_points import GradedPoints
from solidsph_cases.kernel_profiles import KernelProfiles
from tests.commands.test_cli import solidsph

AXES = {"along": (8, 12)}
OTHER = {"gradient": ("consistent",)}


def inline(folder: Path) -> SweepSetup:
    return SweepSetup(Inline(), folder)


def test_the_largest_step_saves_steps_and_costs_no_accuracy(tmp_path: Path) -> None:
    case = GradedPoints()
    made = frontier(case, AXES, inline(tmp_path))
    found = at_largest_step(case, made, inline(tmp_path))
    assert [id(one.usual) for one in found] == [id(point) for point in made.front()]
    for one in found:
        assert one.point.finished
        assert one.factor == DEFAULT_FACTOR
        assert one.point.settings == {**one.usual.settings, "time_step_factor": LARGEST}
        # No cut: the steps are fewer as the factors say, to a step of rounding up.
        assert one.point.steps == pytest.approx(DEFAULT_FACTOR / LARGEST * one.usual.steps, abs=1)
        # Steps of their own change a frequency by (omega dt)^2 / 24; in four transits of the bar
        # omega t is 4 pi.
        own = (4.0 * pi / one.point.steps) ** 2 / 24.0
        assert one.point.error == pytest.approx(one.usual.error, abs=own)
    again = at_largest_step(case, made, inline(tmp_path))
    assert again == found  # from the journal, times and all


@pytest.mark.parametrize(
    ("case", "axes"),
    [
        (Csm1(), {"across": (5,)}),  # an equilibrium
        (KernelProfiles(), {"kernel": ("cubic-spline",)}),  # runs no scene
        (GradedPoints(along=8), {"time_step_factor": (0.5, 0.6)}),
        (with_settings(GradedPoints(along=8), {"time_step_factor": LARGEST}), OTHER),
        (with_settings(GradedPoints(along=8), {"time_step": 1e-5}), OTHER),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Case) else "",
)
def test_nothing_is_run_where_the_step_is_no_question(
    case: Case, axes: dict[str, tuple[object, ...]], tmp_path: Path
) -> None:
    points = [Point({name: value}, 0.1) for name, values in axes.items() for value in values]
    made = Frontier(points, next(iter(axes)))
    folder = tmp_path / "none"
    assert at_largest_step(case, made, inline(folder)) == []
    assert not folder.exists()


def test_a_sentence_says_what_it_gives_and_what_it_cost() -> None:
    one = LargerStep(
        Point({"n": 5}, 0.02, seconds=[4.0]), 0.7, Point({"n": 5}, 0.021, seconds=[3.0, 3.5])
    )
    assert larger_step_sentence([one]) == (
        "with 0.8 of the critical step in place of 0.7, n 5 gives 2.1 % in 3.25 s in place of 2 % "
        "in 4 s; to know this of the front took 6.5 s of runs"
    )
    failed = LargerStep(one.usual, 0.7, Point({"n": 5}, float("inf"), "it broke\nbadly"))
    assert "n 5 gives no result (it broke) in place of 2 % in 4 s" in larger_step_sentence([failed])
    assert larger_step_sentence([]) == ""


@pytest.mark.validation
def test_the_command_shows_it(tmp_path: Path) -> None:
    arguments = ("cost", "graded-points", "--axis", "along=8,12", "--report")
    done = solidsph(*arguments, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["largest step"].startswith("with 0.8 of the critical step in place of 0.6, along")
    for row in told["points"]:
        assert (row[ERROR] != "") is (row[TIME] != "") is row["on the front"]
    assert ERROR in (tmp_path / told["table"]).read_text().splitlines()[0]
    page = (tmp_path / told["report"]).read_text()
    assert f'<p id="larger-step">{told["largest step"]}.</p>' in page
    assert "0.8 of the step: error [%]" in page
    assert told["largest step"] in solidsph(*arguments[:-1], cwd=tmp_path).stdout.replace("\n", " ")


def test_a_report_of_a_sweep_without_it_has_no_such_columns(tmp_path: Path) -> None:
    case = Csm1()
    made = frontier(case, {"across": (5,)}, inline(tmp_path))
    write_report(made, case, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert "of the step: error" not in text
    assert "larger-step" not in text
