"""solidsph reproduce: figures by name, pictures, data and verdicts."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import ClassVar

import attrs
import numpy as np
import pytest
from matplotlib.figure import Figure

from solidsph import SceneError
from solidsph.registry import registry
from solidsph.studies.case import Case, Measurement
from solidsph.studies.gallery import write_gallery
from solidsph.studies.reproduce import figures, reproduce
from tests.commands.test_cli import solidsph


@attrs.frozen
class Straight(Case):
    """A case without a run: a line, and what it should be."""

    title: ClassVar[str] = "a straight line"
    source: ClassVar[str] = "by eye"
    figures: ClassVar[tuple[str, ...]] = ("fig-3", "fig-12", "section-6-line")

    def scenes(self):
        return {}

    def measure(self, records):
        return [Measurement("slope of <f>", 1.0, "1", 1.0, paper="one", error=0.0)]

    def draw(self, records, folder: Path):
        names = "fig-3-line", "section-6-line", "fig-12-line", "section-6-lines", "extra"
        paths = [folder / f"{name}.png" for name in names]
        for path in paths:
            folder.mkdir(parents=True, exist_ok=True)
            Figure(figsize=(1.0, 1.0)).savefig(path)
        return paths

    def curves(self, records):
        return {"line": {"x [m]": np.arange(3.0), "y [m]": np.arange(3.0) / 3.0}}


@pytest.fixture
def only_straight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "names", lambda kind: ("straight",))
    monkeypatch.setattr(registry, "load", lambda kind, name: Straight)


def silent(name, simulation):
    return ()


@pytest.mark.usefixtures("only_straight")
def test_pictures_of_the_figures_asked_for_and_all_data(tmp_path: Path) -> None:
    made = reproduce(["fig-12"], tmp_path, silent)
    assert made.passed
    assert [path.name for path in made.pictures] == ["fig-12-line.png"]
    assert made.sheet is not None
    assert made.sheet.exists()
    every = reproduce([], tmp_path, silent)
    assert [path.stem for path in every.pictures] == ["fig-3-line", "fig-12-line", "section-6-line"]
    (table,) = every.results["straight"].tables
    assert table.read_text().splitlines()[0] == "x [m],y [m]"
    assert np.loadtxt(table, delimiter=",", skiprows=1)[:, 1] == pytest.approx([0, 1 / 3, 2 / 3])


@pytest.mark.usefixtures("only_straight")
def test_the_gallery_shows_pictures_and_numbers(tmp_path: Path) -> None:
    page = tmp_path / "docs" / "gallery.md"
    write_gallery(reproduce([], tmp_path, silent), page)
    text = page.read_text()
    for path in re.findall(r"\]\((.*?)\)", text):
        assert (page.parent / path).exists()
    assert text.count("![") == 5
    assert "| slope of &lt;f> | one | 1 | 1 | 1 | 0 % |" in text


@pytest.mark.usefixtures("only_straight")
def test_an_unknown_figure_names_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="did you mean 'fig-12'"):
        reproduce(["fig-112"], tmp_path, silent)


def test_every_figure_has_one_case_and_the_list_shows_it(tmp_path: Path) -> None:
    known = figures()
    numbered = [name for name in known if name.startswith("fig-")]
    assert numbered == sorted(numbered, key=lambda name: int(name.removeprefix("fig-")))
    assert [*numbered, *sorted(set(known) - set(numbered))] == list(known)
    listed = json.loads(solidsph("reproduce", "--list", "--json", cwd=tmp_path).stdout)
    assert {row["figure"]: row["case"] for row in listed["figures"]} == known
    wrong = solidsph("reproduce", "fig-99", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "no case reproduces 'fig-99'" in wrong.stderr
