"""How far a run is, as people see it."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any, final

import pytest

from solidsph import Simulation
from solidsph.run.progress import RunProgress
from solidsph.studies.point import Point
from solidsph.studies.sweep import SweepStatus
from solidsph.studies.sweep_progress import SweepProgress
from solidsph.system import progress_display as displays
from solidsph.system.progress_display import NotebookDisplay, ProgressDisplay, in_notebook
from tests.helpers.scenes import box


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return box(2).title("[b]x[/b] & y").boundary("clamp", where="left").outputs(4).build()


@final
class Kept(ProgressDisplay):
    def __init__(self) -> None:
        self.parts: list[float] = []
        self.notes: list[str] = []
        self.last: tuple[float, str] | None = None

    def show(self, part: float, note: str = "") -> None:
        self.parts.append(part)
        self.notes.append(note)

    def close(self, part: float, note: str) -> None:
        self.last = (part, note)


def test_a_run_shows_the_part_that_is_done(simulation: Simulation) -> None:
    display = Kept()
    simulation.run(observers=[RunProgress(display)])
    # At the start, then at each output.
    assert display.parts == pytest.approx([0.0, *(k / 4 for k in range(5))])
    assert display.notes[1] == "time left not known yet"
    assert "s left" in display.notes[2]
    assert display.last is not None
    part, note = display.last
    assert part == pytest.approx(1.0)
    assert note.startswith("finished after ")


def test_a_script_prints_nothing_unless_asked(
    simulation: Simulation, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not in_notebook()
    simulation.run()
    simulation.run(progress=True)  # this is no terminal
    assert capsys.readouterr() == ("", "")
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes it for one
    simulation.run(progress=True)
    out, err = capsys.readouterr()
    assert out == ""
    assert "[b]x[/b] & y" in err  # as it is, not as markup
    assert "100%" in err
    simulation.run()
    assert capsys.readouterr() == ("", "")


class Notebook:
    """What IPython offers to a display: one that can be updated, and how often it was."""

    def __init__(self) -> None:
        self.shown: list[dict[str, str]] = []
        self.updates = 0

    def display(self, data: dict[str, str], **how: Any) -> Notebook:
        assert how == {"raw": True, "display_id": True}
        self.shown.append(data)
        return self

    def update(self, data: dict[str, str], raw: bool) -> None:
        self.updates += 1
        self.shown[-1] = data


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> Notebook:
    made = Notebook()
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=made.display))
    return made


def test_a_notebook_has_one_bar_that_changes(simulation: Simulation, notebook: Notebook) -> None:
    simulation.run()
    (shown,) = notebook.shown
    assert shown["text/plain"].startswith("[b]x[/b] & y: 100 %, finished after ")
    assert "[b]x[/b] &amp; y: 100 %" in shown["text/html"]
    simulation.run(progress=False)
    assert len(notebook.shown) == 1


def test_a_bar_does_not_change_more_often_than_is_seen(
    notebook: Notebook, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 0.0
    monkeypatch.setattr(displays.clock, "monotonic", lambda: now)
    display = NotebookDisplay("long")
    for _ in range(10_000):  # in 10 s
        now += 1e-3
        display.show(now / 10.0)
    assert 90 <= notebook.updates <= 100
    display.close(1.0, "finished")  # never left out
    assert notebook.shown[-1]["text/plain"] == "long: 100 %, finished"


def test_a_search_counts_what_it_has_run() -> None:
    display = Kept()
    watch = SweepProgress(display)
    for spacing in (0.2, 0.1):  # a sweep of one configuration each
        point = Point({"spacing": spacing}, 0.1)
        watch(SweepStatus(1, 0, 0, None))
        watch(SweepStatus(1, 0, 1, 0.0, outcome=point))
    assert display.parts == [0.0, 0.0]
    assert display.last == (1.0, "2 run, the last with spacing 0.1")
