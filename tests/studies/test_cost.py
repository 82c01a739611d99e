"""solidsph cost, and its functions: what a user sees of error against time."""

from __future__ import annotations

import json
from pathlib import Path

import attrs
import numpy as np
import pandas
import pytest

from solidsph import SceneError
from solidsph.commands.cost_options import seconds
from solidsph.scene.scene import Scene
from solidsph.studies.cost import SweepSetup, default_settings, find_best, frontier
from solidsph.studies.runner import Inline
from solidsph.studies.search import Goal
from solidsph.studies.variant import with_settings
from solidsph_cases.csm1 import Csm1
from tests.commands.test_cli import solidsph

AXES = {"across": (5, 9), "gradient": ("consistent", "quadratic")}


def inline(folder: Path) -> SweepSetup:
    return SweepSetup(Inline(), folder)


def test_a_frontier_of_a_case(tmp_path: Path) -> None:
    made = frontier("csm1", AXES, inline(tmp_path))
    assert [point.settings for point in made.points] == [
        {"across": n, "gradient": g} for n in AXES["across"] for g in AXES["gradient"]
    ]
    table = pandas.DataFrame(made)
    finest = table[(table["across"] == 9) & (table["gradient"] == "consistent")]
    assert finest["error"].item() == table["error"].min() < 0.005
    again = frontier("csm1", AXES, inline(tmp_path))
    assert again.points == made.points  # from the journal, times and all


def test_the_cases_own_parameters_are_among_the_points(tmp_path: Path) -> None:
    case = Csm1(across=5)
    made = frontier(case, {"across": (9,), "cover": (3.0,)}, inline(tmp_path))
    assert made.points[-1].settings == {"across": 5, "cover": 2.6}
    assert default_settings(case, {"across": (), "gravity.strength": ()}) is None


def test_machine_independent_columns_are_the_same_on_every_run(tmp_path: Path) -> None:
    axes = {"across": (5, 6)}
    one, two = (frontier("csm1", axes, inline(tmp_path / name)) for name in "ab")
    for a, b in zip(one.points, two.points, strict=True):
        timeless = {"seconds": (), "peak_memory": 0}
        assert attrs.evolve(a, **timeless) == attrs.evolve(b, **timeless)


def test_a_search_runs_the_case(tmp_path: Path) -> None:
    result = find_best("csm1", Goal(error=0.01), AXES, inline(tmp_path))
    assert result.point is not None
    assert result.point.error <= 0.01
    assert result.point in frontier("csm1", AXES, inline(tmp_path)).points


def test_axes_are_checked_before_anything_runs(tmp_path: Path) -> None:
    for axes, message in (
        ({"acros": (5,)}, "did you mean 'across'"),
        ({"across": (5, 1)}, "at least 3"),
        ({"across": ()}, "no values"),
    ):
        with pytest.raises(SceneError, match=message):
            frontier("csm1", axes, inline(tmp_path))
    with pytest.raises(SceneError, match="give --axis"):
        frontier("kernel-profiles", None, inline(tmp_path))
    assert not list(tmp_path.iterdir())


def by_count(journal: Path) -> None:
    """Replace times in a journal by a microsecond for a pair: what is cheapest is no accident."""
    entries = [json.loads(line) for line in journal.read_text().splitlines()]
    for entry in entries:
        entry["point"]["seconds"] = [1e-6 * entry["point"]["pair_evaluations"]]
    journal.write_text("".join(f"{json.dumps(entry)}\n" for entry in entries))


def test_the_command_and_what_it_leaves(tmp_path: Path) -> None:
    axes = ("--axis", "across=5,7,9", "--axis", "gradient=consistent")
    done = solidsph("cost", "csm1", *axes, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["points"]) == 3
    (journal,) = tmp_path.rglob("*.jsonl")
    by_count(journal)
    # From here on nothing is run: the points are in the journal.
    done = solidsph("cost", "csm1", *axes, "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert len(told["points"]) == 3
    (order,) = told["orders"]
    spacings, errors = (
        [point[key] for point in told["points"]] for key in ("spacing [m]", "error")
    )
    slope = np.polyfit(np.log(spacings), np.log(errors), 1)[0]
    assert order["in spacing"] == pytest.approx(slope)
    (bar,) = told["without a reference"]
    assert bar["true error [%]"] == pytest.approx(100.0 * errors[-1])
    # Turek & Hron's u_x [mm], of which the finest is within half a per cent.
    assert bar["finest"] == pytest.approx(-7.187, rel=0.005)
    assert bar["limit"] == pytest.approx(bar["finest"], rel=0.01)
    assert told["default"]["times the front"] == 1.0
    assert (tmp_path / told["picture"]).read_bytes().startswith(b"\x89PNG")
    assert len((tmp_path / told["table"]).read_text().splitlines()) == 4
    table = solidsph("cost", "csm1", *axes, cwd=tmp_path)
    assert "the front, of 3 configurations" in table.stdout
    assert "bytes touched" not in table.stdout
    assert "bytes touched" in solidsph("cost", "csm1", *axes, "--verbose", cwd=tmp_path).stdout
    assert "the case's own parameters: across 5" in table.stdout
    search = solidsph("cost", "csm1", *axes, "--accuracy", "1%", cwd=tmp_path)
    assert search.returncode == 0, search.stderr
    path = tmp_path / "results/cost/csm1/csm1.toml"
    assert path.read_text().startswith("# across 5, gradient consistent: ")
    chosen = with_settings(Csm1(across=5), {"gradient": "consistent"})
    assert Scene.read(path).to_toml() == chosen.scenes()["csm1"].to_toml()
    missed = solidsph("cost", "csm1", *axes, "--accuracy", "1e-7", "--longest", "1ms", cwd=tmp_path)
    assert missed.returncode == 1
    assert "found: nothing" in missed.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--accuracy", "200"), "between 0 and 100 %"),
        (("--accuracy", "1%", "--time", "1s"), "one at a time"),
        (("--accuracy", "1%", "--report"), "a sweep, not a search"),
        (("--time", "5parsec"), "such as 60s"),
        (("--axis", "across"), "name=value,value"),
        (("--axis", "across=5,5"), "twice"),
        (("--axis", "acros=5"), "did you mean 'across'"),
    ],
)
def test_bad_input_is_one_message(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    done = solidsph("cost", "csm1", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "results").exists()


def test_times_are_read() -> None:
    assert [seconds(one, "--time") for one in ("60", "60s", "2min", "1h", "5 ms")] == [
        60.0,
        60.0,
        120.0,
        3600.0,
        0.005,
    ]
    for wrong in ("", "-1s", "inf", "1..2s"):
        with pytest.raises(SceneError, match="--time must be a time"):
            seconds(wrong, "--time")
