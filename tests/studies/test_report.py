"""A report is one page that holds everything: what is written in it, without a browser."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from html.parser import HTMLParser
from math import inf
from pathlib import Path
from typing import Any

import attrs
import pytest

from solidsph import SceneError
from solidsph.studies.frontier import Frontier
from solidsph.studies.point import Point
from solidsph.studies.report import write_report
from solidsph.studies.report_figures import EXPENSES, TIME, Figures, library
from solidsph.studies.variant import with_settings
from solidsph_cases.csm1 import Csm1
from tests.commands.test_cli import solidsph
from tests.helpers.reporting import HOSTILE, OfFunctions, hostile, known
from tests.helpers.sweeping import Odd

VOID = {"meta", "input", "br", "link", "img", "hr", "wbr", "source", "base", "embed"}


class Read(HTMLParser):
    """Elements with their attributes and texts; an element closed out of turn is an error."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, Mapping[str, str | None], list[str]]] = []
        self._open: list[tuple[str, Mapping[str, str | None], list[str]]] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert len(dict(attrs)) == len(attrs), f"{tag} has an attribute twice"
        element = (tag, dict(attrs), [])
        self.elements.append(element)
        if tag not in VOID:
            self._open.append(element)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        for _, _, texts in self._open:
            texts.append(data)

    def texts(self, tag: str) -> Sequence[str]:
        return ["".join(texts) for one, _, texts in self.elements if one == tag]

    def of(self, identity: str) -> str:
        (found,) = ("".join(t) for _, a, t in self.elements if a.get("id") == identity)
        return found

    @property
    def data(self) -> Any:
        return json.loads(self.of("data"))


def page(made: Frontier, case: Any, folder: Path, **more: Any) -> Read:
    path = folder / "deep" / "report.html"
    write_report(made, case, path, **more)
    return Read(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Read:
    return page(known(), Csm1(), tmp_path_factory.mktemp("report"))


def test_it_says_what_a_person_can_act_on(report: Read) -> None:
    made = known()
    assert report.of("sentence") == made.sentence()
    assert report.texts("h1") == [f"{Csm1.title}: what accuracy costs"]
    assert [text for text in report.texts("pre") if "diverged" in text] == [
        "diverged at step 120\nof 170"
    ]
    orders = report.of("orders")
    for one in made.orders():
        assert f"{one.in_spacing:.2f}" in orders
        assert f"{one.in_time:.2f}" in orders


def test_it_needs_no_other_file_and_no_network(report: Read) -> None:
    for tag, attributes, _ in report.elements:
        assert tag not in ("link", "img", "iframe", "object", "embed", "base"), tag
        for name in ("src", "href", "srcset", "data", "poster", "action"):
            assert (attributes.get(name) or "#").startswith("#"), (tag, attributes)
    (style,) = report.texts("style")
    assert not re.search(r"@import|url\(", style)
    data, plotly, own = report.texts("script")
    assert plotly == library()
    assert not re.search(r"https?:|import\s*\(|fetch\(|XMLHttpRequest", own)
    (policy,) = (a["content"] for _, a, _ in report.elements if "http-equiv" in a)
    assert policy is not None
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules.pop("default-src") == "'none'"
    sources = {source for rule in rules.values() for source in rule.split()}
    assert sources == {"'unsafe-inline'", "data:", "blob:", "'none'"}
    assert data


def test_every_identity_is_there_once(report: Read) -> None:
    known_ids = [a["id"] for _, a, _ in report.elements if "id" in a]
    assert len(known_ids) == len(set(known_ids))
    for _, attributes, _ in report.elements:
        for name in ("for", "aria-labelledby"):
            assert attributes.get(name, known_ids[0]) in known_ids


def test_the_scene_of_every_point_is_in_the_page(report: Read) -> None:
    points = report.data["points"]
    assert len(points) == len(known())
    for point, shown in zip(known().points, points, strict=True):
        (scene,) = with_settings(Csm1(), point.settings).scenes().values()
        (written,) = shown["scenes"]
        assert written["toml"] == scene.to_toml()
    names = [one["file"] for shown in points for one in shown["scenes"]]
    assert names == [f"csm1-{n}.toml" for n in range(1, 8)]


def test_settings_that_are_words_of_the_scene_are_in_it(tmp_path: Path) -> None:
    made = Frontier([Point({"across": 5, "outputs": 7}, 0.1, seconds=(1.0,))], "across")
    (point,) = page(made, Csm1(), tmp_path).data["points"]
    assert "outputs = 7\n" in point["scenes"][0]["toml"]


def test_what_has_no_scene_says_why(tmp_path: Path) -> None:
    one = Frontier([Point({}, 0.1, seconds=(1.0,))], "across")
    (point,) = page(one, Odd("log"), tmp_path).data["points"]
    assert point["scenes"] == []
    assert "runs no scene" in point["note"]
    (point,) = page(one, OfFunctions(), tmp_path).data["points"]
    plain, moved = point["scenes"]
    as_it_is = with_settings(Csm1(across=5), {"gradient": "consistent"})
    assert plain["toml"] == as_it_is.scenes()["csm1"].to_toml()
    assert "toml" not in moved
    assert "cannot be written: " in moved["why"]
    assert "function" in moved["why"]
    refused = Frontier([Point({"across": 1}, inf, "refused")], "across")
    (point,) = page(refused, Csm1(), tmp_path).data["points"]
    assert "at least 3" in point["note"]


def test_the_table_has_every_point_and_marks_the_front(report: Read) -> None:
    made = known()
    rows = [
        (attributes, texts)
        for tag, attributes, texts in report.elements
        if "data-point" in attributes
    ]
    assert [attributes["data-point"] for attributes, _ in rows] == [str(n) for n in range(7)]
    for point, (attributes, texts) in zip(made.points, rows, strict=True):
        assert (attributes.get("class") == "front") == (point in made.front())
        assert ("front" in texts) == (point in made.front())
        assert str(point.settings["across"]) in texts
        if point.finished:
            assert f"{100.0 * point.error:.3g}" in texts


def test_hostile_words_stay_words(tmp_path: Path) -> None:
    made = hostile()
    read = page(made, Csm1(), tmp_path, title=HOSTILE)
    assert len(read.texts("script")) == 3
    assert "img" not in [tag for tag, _, _ in read.elements]
    assert read.texts("h1") == [f"{HOSTILE}: what accuracy costs"]
    assert HOSTILE in read.texts("td")
    assert HOSTILE in read.texts("pre")
    assert read.data["points"][0]["label"] == made.points[0].label()
    (scene,) = with_settings(Csm1(), made.points[0].settings).scenes().values()
    assert read.data["points"][0]["scenes"][0]["toml"] == scene.to_toml()
    # Plotly takes tags in its texts: none of ours is one.
    for text in _texts(read.data["expenses"]):
        assert set(re.findall(r"</?\w+", text)) <= {"<br", "<sub", "</sub"}


def _texts(data: Any) -> Sequence[str]:
    if isinstance(data, str):
        return [data]
    inside = data.values() if isinstance(data, dict) else data if isinstance(data, list) else []
    return [text for one in inside for text in _texts(one)]


def drawn(figure: Mapping[str, Any], *, front: bool) -> set[tuple[float, float]]:
    return {
        place
        for trace in figure["data"]
        if "customdata" in trace and ("front" in trace["name"]) == front
        for place in zip(trace["x"], trace["y"], strict=True)
    }


@pytest.mark.parametrize("expense", EXPENSES)
def test_every_point_is_drawn_once_and_the_front_is_that_of_the_cost(expense: Any) -> None:
    made = known()
    figure = Figures(made).against(expense)
    front = {(expense.of(p), 100.0 * p.error) for p in made.front(expense.of)}
    assert drawn(figure, front=True) == front
    everything = {(expense.of(p), 100.0 * p.error) for p in made.finished()}
    assert drawn(figure, front=False) == everything - front
    numbers = [n for trace in figure["data"] for n in trace.get("customdata", [])]
    assert sorted(numbers) == [0, 1, 2, 3, 4, 5]
    assert figure["layout"]["xaxis"]["type"] == figure["layout"]["yaxis"]["type"] == "log"
    assert figure["layout"]["xaxis"]["title"]["text"] == expense.heading
    (line,) = (t for t in figure["data"] if t["mode"] == "lines")
    assert line["x"] == sorted(line["x"])
    assert set(zip(line["x"], line["y"], strict=True)) == front


def test_bars_go_from_the_quickest_repeat_to_the_slowest() -> None:
    made = known()
    for trace in Figures(made).against(TIME)["data"]:
        for place, number in enumerate(trace.get("customdata", [])):
            point = made.points[number]
            bars = trace["error_x"]
            assert trace["x"][place] - bars["arrayminus"][place] == pytest.approx(
                min(point.seconds)
            )
            assert trace["x"][place] + bars["array"][place] == pytest.approx(max(point.seconds))
    assert not any("error_x" in trace for trace in Figures(made).against(EXPENSES[1])["data"])


def test_what_is_said_of_a_point_is_all_that_is_known() -> None:
    made = known()
    traces = Figures(made).against(TIME)["data"]
    said = {
        number: text
        for trace in traces
        for number, text in zip(
            trace.get("customdata", []), trace.get("hovertext", []), strict=True
        )
    }
    for words in (
        *("across: 9", "gradient: consistent", "error: 1.2 % of tip: u_x", "steps: 90"),
        *("wall time: 0.6 s, from 0.54 to 0.72 s in 3 repeats", "pair evaluations: 3e+07"),
        *("peak memory: 159 MiB", "particles: 1458, spacing 0.0025 m", "outcome: finished"),
    ):
        assert words in said[1].split("<br>")


def test_every_scheme_is_a_line_over_the_spacing() -> None:
    made = known()
    traces = [t for t in Figures(made).against_spacing(TIME)["data"] if "customdata" in t]
    lines = {tuple(trace["x"]): trace for trace in traces}
    for points in made.schemes().values():
        numbers = [made.points.index(point) for point in points]
        assert any(trace["customdata"] == numbers for trace in traces)
    assert lines
    # By time only one scheme is on the front; it is black, whatever the screen.
    by_name = {trace["name"]: trace["line"]["color"] for trace in traces}
    assert by_name == {"gradient consistent": "#000000", "schemes off the front": "#a6a6a6"}


def test_a_cost_that_is_not_known_is_not_offered(tmp_path: Path) -> None:
    unknown = [attrs.evolve(point, pair_evaluations=0) for point in known().points]
    read = page(Frontier(unknown, "across"), Csm1(), tmp_path)
    assert [one is None for one in read.data["expenses"]] == [False, True, False]
    buttons = {a["data-expense"]: a for _, a, _ in read.elements if "data-expense" in a}
    assert ["disabled" in buttons[n] for n in "012"] == [False, True, False]


def test_an_error_of_nothing_is_told_and_not_drawn(tmp_path: Path) -> None:
    exact, *others = known().points
    read = page(Frontier([attrs.evolve(exact, error=0.0), *others], "across"), Csm1(), tmp_path)
    assert any("an error of exactly 0" in text for text in read.texts("p"))
    assert read.data["points"][0]["places"] is None


def test_without_plotly_there_is_one_message_before_anything_runs(tmp_path: Path) -> None:
    missing = tmp_path / "without"
    missing.mkdir()
    (missing / "plotly.py").write_text("raise ImportError('not here')\n")
    arguments = ("cost", "csm1", "--axis", "across=5", "--report")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "solidsph", *arguments],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
        env={**os.environ, "PYTHONPATH": str(missing)},
    )
    assert done.returncode == 2
    assert "pip install 'solidsph[report]'" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "results").exists()


def test_the_function_says_that_plotly_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("plotly.offline", "plotly.graph_objects"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(SceneError, match=r"pip install 'solidsph\[report\]'"):
        write_report(known(), Csm1(), tmp_path / "report.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.validation
def test_the_command_writes_it_beside_the_points(tmp_path: Path) -> None:
    axes = ("--axis", "across=5,9", "--axis", "gradient=consistent")
    done = solidsph("cost", "csm1", *axes, "--report", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    path = tmp_path / told["report"]
    assert path == tmp_path / "results/cost/csm1/csm1-report.html"
    read = Read(path.read_text(encoding="utf-8"))
    assert read.of("sentence") == told["sentence"]
    labels = [point["label"] for point in read.data["points"]]
    assert labels == ["across 5, gradient consistent", "across 9, gradient consistent"]
    path.unlink()
    plain = solidsph("cost", "csm1", *axes, "--report", cwd=tmp_path)
    assert f"report: {told['report']}" in plain.stdout
    assert path.exists()
    path.unlink()
    solidsph("cost", "csm1", *axes, cwd=tmp_path)
    assert not path.exists()
