"""The cost of accuracy of a scene that a user has written, with and without a reference."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidsph import Record, Scene, SceneError, cli
from solidsph.commands.limit_tables import limit_rows
from solidsph.studies.cost import SweepSetup, find_best, frontier
from solidsph.studies.limit import Limit
from solidsph.studies.point import Point
from solidsph.studies.refine import refine
from solidsph.studies.refinement import judged, limits
from solidsph.studies.runner import Inline
from solidsph.studies.scene_case import SceneCase
from solidsph.studies.search import Goal
from solidsph.studies.task_lines import decode_point, encode_point
from solidsph.studies.variant import with_settings
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML
from tests.studies.known_scenes import KNOWN, KnownScene

WAVES: KnownScene = KNOWN["waves of displacement"]()
SCENE = WAVES.scene(0.0625)
STRESS = "quarter stress xx"
TRUTH = WAVES.truth[f"final {STRESS} [Pa]"]
OTHER = """[body.other]
shape = {type = "box", lengths = [1.0, 1.0], origin = [2.0, 0.0]}
spacing = 0.125
"""


def inline(folder: Path) -> SweepSetup:
    return SweepSetup(Inline(), folder)


def test_a_scene_without_a_reference_is_estimated(tmp_path: Path) -> None:
    made = frontier(SCENE, None, inline(tmp_path))
    assert [point.settings for point in made.points] == [
        {"spacing": 0.125},
        {"spacing": 0.08839},
        {"spacing": 0.0625},
    ]
    assert {limit.quantity for limit in made.limits} == set(WAVES.truth)
    for limit in made.limits:
        for point in made.points:
            value, scale = point.values[limit.quantity]
            true = abs(value - WAVES.truth[limit.quantity]) / scale
            assert true <= limit.error(value, point.settings)
    # The worst quantity counts.
    finest = made.points[-1]
    assert finest.error == max(limit.bar for limit in made.limits)
    assert finest.quantity == "final edge stress xx [Pa]"
    assert "spacing 0.0625" in made.sentence()


def test_other_schemes_are_judged_by_the_same_limit(tmp_path: Path) -> None:
    case = SceneCase.of(SCENE, [STRESS])
    axes = {"spacing": (0.125, 0.0909, 0.0625), "gradient": ("consistent", "corrected")}
    made = frontier(case, axes, inline(tmp_path))
    (limit,) = made.limits
    assert limit.scheme == {"gradient": "consistent"}  # whose bar is smaller
    for point in made.points:
        true = abs(point.values[limit.quantity][0] - TRUTH) / limit.scale
        assert true <= point.error
        assert point.reference == limit.value


def test_a_reference_takes_the_place_of_the_estimate(tmp_path: Path) -> None:
    case = SceneCase.of(SCENE, [], [f"{STRESS}={TRUTH!r}"])
    made = frontier(case, {"spacing": (0.125, 0.0625)}, inline(tmp_path))  # two spacings will do
    assert not made.limits
    for point in made.points:
        assert point.value is not None
        assert point.error == pytest.approx(abs(point.value / TRUTH - 1.0))


def test_a_search_meets_the_truth(tmp_path: Path) -> None:
    case = SceneCase.of(SCENE, [STRESS])
    found = find_best(case, Goal(error=0.01), None, inline(tmp_path))
    assert found.point is not None
    assert abs(found.point.values[f"final {STRESS} [Pa]"][0] / TRUTH - 1.0) <= 0.01
    assert found.limits
    assert found.spent == pytest.approx(sum(sum(p.seconds) for p in found.tried))
    count = len((tmp_path / "points.jsonl").read_text().splitlines())
    assert count == len(found.tried)
    find_best(case, Goal(error=0.01), None, inline(tmp_path))  # from the journal
    assert len((tmp_path / "points.jsonl").read_text().splitlines()) == count


def power(order: float, limit: float = 1.0) -> Callable[[Mapping[str, Any]], Point]:
    """Points whose error is a power of the spacing, and their time the inverse cube."""

    def run(settings: Mapping[str, Any]) -> Point:
        h = settings["spacing"]
        value = limit + h**order
        return Point(settings, np.inf, spacing=h, seconds=(h**-3,), values={"u": (value, value)})

    return run


@pytest.mark.parametrize(("order", "error"), [(1.0, 0.05), (2.0, 0.005)])
def test_refinement_ends_where_the_bar_is_small_enough(order: float, error: float) -> None:
    run = power(order)
    made = refine([0.4, 0.28, 0.2], {}, Goal(error=error), run, longest=1e9)
    errors = [abs(p.values["u"][0] - 1.0) / p.values["u"][1] for p in made.points]
    assert made.points[-1].error <= error < made.points[-2].error
    assert all(p.error >= e for p, e in zip(made.points, errors, strict=True))
    # Steps between the spacings that were run: the cheapest that will do is not far from one.
    ratios = np.array(made.spacings[:-1]) / made.spacings[1:]
    assert np.all(ratios < 1.25)


def test_refinement_stops_before_what_would_take_too_long() -> None:
    run = power(1.0)
    made = refine([0.4, 0.28, 0.2], {}, Goal(error=1e-6), run, longest=500.0)
    assert max(point.time for point in made.points) < 500.0
    assert 0.2 / 2.0**0.5 > made.spacings[-1] > 1.0 / 500.0 ** (1 / 3) / 1.5


def test_fewer_than_three_spacings_are_no_estimate() -> None:
    ran = [
        Point({"spacing": h}, np.inf, spacing=h, values={"u": (1.0 + h, 1.0)}) for h in (2.0, 1.0)
    ]
    lost = Point({"spacing": 4.0}, np.inf, outcome="no particles inside")
    with pytest.raises(SceneError, match="spacing 4: no particles inside"):
        limits([lost, *ran], "spacing")


def test_equal_results_are_exact() -> None:
    points = [
        Point({"spacing": h}, np.inf, spacing=h, values={"u": (1.0 + 1e-12 * h, 1.0)})
        for h in (4.0, 2.0, 1.0)
    ]
    (limit,) = limits(points, "spacing")
    assert not limit.warning
    assert judged(points[0], [limit]).error < 1e-11


def test_a_quantity_that_is_nothing_has_no_error() -> None:
    limit = Limit("u", 0.0, 0.0, 0.0, 2.0, {}, 0.0, "")
    assert limit.error(0.0, {}) == 0.0


def test_values_travel_between_processes() -> None:
    point = Point({"spacing": 1.0}, np.inf, values={"u": (1.5, np.inf)})
    assert decode_point(json.loads(json.dumps(encode_point(point))), point.settings) == point


def test_bodies_keep_the_ratio_of_their_spacings() -> None:
    scene = Scene.from_toml(SCENE.to_toml() + OTHER)
    case = with_settings(SceneCase.of(scene, [STRESS]), {"spacing": 0.05})
    (changed,) = case.scenes().values()
    assert [body.spacing for body in changed.bodies.values()] == [0.05, 0.1]
    assert case.resolution == 0.05


def test_a_scene_that_says_what_it_should_be(tmp_path: Path) -> None:
    given = f'\n[[reference]]\nquantity = "{STRESS}"\nvalue = {TRUTH!r}\nsource = "by hand"\n'
    scene = Scene.from_toml(SCENE.to_toml() + given)
    assert Scene.from_toml(scene.to_toml()) == scene
    case = SceneCase.of(scene)
    assert case.source == "by hand"
    assert [reference.source for reference in case.references] == ["by hand"]
    path = tmp_path / "waves.toml"
    path.write_text(scene.to_toml())
    done = solidsph("run", "waves.toml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)["references"]
    assert row["error"] < 0.01
    path.write_text(scene.to_toml().replace(repr(TRUTH), repr(2.0 * TRUTH)))
    done = solidsph("run", "waves.toml", "--quiet", cwd=tmp_path)
    assert done.returncode == 1
    assert "beside the references" in done.stdout


def test_a_column_may_have_several_references(tmp_path: Path) -> None:
    case = SceneCase.of(SCENE, [], [f"{STRESS}={TRUTH!r}", f"{STRESS}={2.0 * TRUTH!r}"])
    made = frontier(case, {"spacing": (0.125,)}, inline(tmp_path))
    assert made.points[0].error == pytest.approx(0.5, abs=0.05)  # the worst counts


def test_the_command_on_a_scene(tmp_path: Path) -> None:
    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    done = solidsph("cost", "waves.toml", "--of", STRESS, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["case"] == "waves"
    assert len(told["points"]) >= 3
    (limit,) = told["without a reference"]
    assert abs(limit["finest"] / TRUTH - 1.0) <= limit["error [%]"] / 100.0
    assert (tmp_path / told["picture"]).exists()
    table = solidsph("cost", "waves.toml", "--of", STRESS, cwd=tmp_path)
    assert "estimated by refinement" in table.stdout
    assert "the scene as it is" in table.stdout


def test_the_spacing_of_the_only_body_is_that_of_the_scene(tmp_path: Path) -> None:
    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    axis = "body.square.spacing=0.25,0.125,0.0625"
    done = solidsph("cost", "waves.toml", "--of", STRESS, "--axis", axis, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [point["spacing"] for point in told["points"]] == [0.25, 0.125, 0.0625]
    assert (told["outcome"], told["exit code"]) == ("finished", 0)


def test_a_scene_that_never_finishes_has_no_front(tmp_path: Path) -> None:
    text = SCENE_TOML.replace("1e3*min(t/0.005, 1)", "1e12*t")
    probe = '\n[[probe]]\nlabel = "end"\nquantity = "displacement x"\npoint = [1.0, 0.25]\n'
    (tmp_path / "scene.toml").write_text(text + probe)
    done = solidsph("cost", "scene.toml", cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert "the scene as it is: spacing 0.125: failed" in done.stdout
    assert "picture" not in done.stdout
    assert "inf" not in done.stdout
    assert not list(tmp_path.rglob("*.png"))


def test_an_interrupted_search_says_that_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("solidsph.commands.accuracy.find_best", interrupted)
    monkeypatch.setattr("sys.argv", ["solidsph", "run", "waves.toml", "--accuracy", "1%"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 130
    told = capsys.readouterr().err
    assert "the same command goes on" in told
    assert "resume" not in told  # there is no record


def test_a_run_to_an_accuracy(tmp_path: Path) -> None:
    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    done = solidsph("run", "waves.toml", "--accuracy", "1%", "--of", STRESS, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    (bar,) = told["error bars"]
    assert abs(bar["value"] - TRUTH) <= bar["+-"] <= 0.01 * abs(TRUTH) * 1.01
    assert told["accuracy"]["spent [s]"] > 0.0
    with Record(tmp_path / told["record"]) as record:
        (name,) = record.error_bars
        assert name == f"final {STRESS} [Pa]"
        assert record.error_bars[name].value == bar["value"]
        assert record.error_bars[name].bar == bar["+-"]
    drawn = solidsph("plot", told["record"], cwd=tmp_path)
    assert "record-probes.png" in drawn.stdout


def test_a_search_that_cannot_tell_an_error_shows_what_it_ran(tmp_path: Path) -> None:
    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    asked = ("--accuracy", "1e-9", "--of", STRESS, "--longest", "1ms")
    for verb in ("run", "cost"):
        missed = solidsph(verb, "waves.toml", *asked, cwd=tmp_path)
        assert missed.returncode == 1
        assert "needs 3 spacings" in missed.stdout
        assert "0.001 s are allowed; allow more" in missed.stdout
        assert "spacing 0.125" in missed.stdout.split("needs 3 spacings")[0]
        assert "inf" not in missed.stdout
    assert not list(tmp_path.rglob("*.h5"))


def test_a_sweep_that_cannot_tell_an_error_shows_what_it_ran(tmp_path: Path) -> None:
    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    asked = ("cost", "waves.toml", "--of", STRESS, "--axis", "spacing=3.0,2.5,0.125,0.0625")
    done = solidsph(*asked, cwd=tmp_path)
    assert done.returncode == 1
    assert "an error bar needs 3 spacings with the same scheme that finish" in done.stdout
    assert "failed: spacing 2.5: the simulation cannot be built: " in done.stdout
    assert "spacing 0.0625: its error is not known" in done.stdout
    told = json.loads(solidsph(*asked, "--json", cwd=tmp_path).stdout)
    assert (told["outcome"], told["exit code"]) == ("failed", 1)
    assert "needs 3 spacings" in told["sentence"]
    rows = told["measured"]
    assert [row["configuration"] for row in rows] == ["spacing 0.125", "spacing 0.0625"]
    for row in rows:
        assert row["value"] == pytest.approx(TRUTH, rel=0.05)
    case = SceneCase.of(SCENE, [STRESS])
    made = frontier(case, {"spacing": (3.0, 2.5, 0.125, 0.0625)}, inline(tmp_path / "again"))
    assert made.front() == []
    assert "spacing 0.125" in made._repr_html_()


def test_without_a_limit_none_is_told(tmp_path: Path) -> None:
    """The finest value stands for it in the error bar, and is no limit."""
    points = [
        Point({"spacing": h}, np.inf, spacing=h, values={"u": (-np.log(h), 1.0)})
        for h in (0.4, 0.2, 0.1)
    ]
    known = limits(points, "spacing")
    (row,) = limit_rows(known)
    assert "no limit is in sight" in row["warning"]
    assert row["tends to"] is None
    assert row["finest"] == -np.log(0.1)
    assert judged(points[0], known).reference is None


def test_a_misspelt_reference_is_refused_before_anything_is_said_to_be_replaced(
    tmp_path: Path,
) -> None:
    path = tmp_path / "waves.toml"
    path.write_text(SCENE.to_toml())
    assert solidsph("run", "waves.toml", cwd=tmp_path).returncode == 0
    record = tmp_path / "results/waves/record.h5"
    before = record.read_bytes()
    wrong = f'\n[[reference]]\nquantity = "{STRESS[:-1]}"\nvalue = 1.0\n'
    path.write_text(SCENE.to_toml() + wrong)
    done = solidsph("run", "waves.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert f"did you mean '{STRESS}'" in done.stderr
    assert "replaced" not in done.stderr
    assert record.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cost", "waves.toml", "--of", "quarter strain"), "did you mean"),
        (("cost", "waves.toml", "--reference", "1.0"), "several columns"),
        (("cost", "waves.toml", "--reference", f"{STRESS}=no.csv"), "cannot be read"),
        (("cost", "waves.toml", "--axis", "body.sqare.spacing=0.1,0.2"), "did you mean 'square'"),
        (("cost", "waves.toml", "--axis", "spacing=-1.0"), "must be a length"),
        (("cost", "waves.toml", "--axis", "gradient=corrected,cubik"), "did you mean 'cubic'"),
        (("cost", "waves.toml", "--axis", "material.densty=1,2"), "did you mean 'density'"),
        (("cost", "waves.toml", "--axis", "cover=2.6,wide"), "cover = 'wide': cover must be"),
        (("cost", "waves.toml", "--axis", "spacing=0.125,0.0625"), "needs 3 spacings"),
        (("cost", "waves.toml", "--of", STRESS, "--reference", "late.csv"), "from t = 7 to 8 s"),
        (("cost", "two.toml", "--axis", "body.other.spacing=0.2,0.1,0.05"), "all bodies together"),
        (("cost", "waves.toml", "--axis", "material.density=1,2"), "what is simulated, not how"),
        (("cost", "waves.toml", "--set", "colour=red"), "no such word of a scene"),
        (("cost", "csm1", "--of", "tip"), "are for a scene"),
        (("run", "waves.toml", "--of", STRESS), "add --accuracy"),
        (("run", "csm1", "--accuracy", "1%"), "solidsph cost CASE --accuracy"),
        (("run", "waves.toml", "--accuracy", "200"), "between 0 and 100 %"),
    ],
)
def test_bad_input_is_one_message(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    (tmp_path / "waves.toml").write_text(SCENE.to_toml())
    (tmp_path / "two.toml").write_text(SCENE.to_toml() + OTHER)
    (tmp_path / "late.csv").write_text("7,0\n8,1\n")
    done = solidsph(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "results").exists()
