"""What a build says while it goes on: a line on a terminal, and nothing elsewhere."""

from __future__ import annotations

import io
import logging
import re
from pathlib import Path

import pytest
from rich.console import Console
from rich.progress import Progress

from solidsph import Simulation
from solidsph.commands import console, verbosity
from solidsph.commands.build_line import BuildLine
from solidsph.system.build_log import BUILD, tell_built
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML, SOFT, box


class Clock:
    """Time that passes when told to [s]."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> io.StringIO:
    """What is written on a terminal."""
    file = io.StringIO()
    screen = Console(file=file, force_terminal=True, width=80, highlight=False)
    for module in (console, verbosity):
        monkeypatch.setattr(module, "err", screen)
    monkeypatch.setattr("solidsph.commands.console.clock.monotonic", clock)
    return file


def test_a_line_appears_after_a_second_and_goes_with_the_build(clock: Clock) -> None:
    line = BuildLine(clock)
    with line.listening():
        BUILD.info("body %r: particles", "part")
        clock.now += 0.9
        assert line.text().plain == ""
        clock.now += 1.2
        assert line.text().plain == "building, 2 s: body 'part': particles"
        BUILD.debug("step %d of %d", 3, 40)
        assert line.text().plain == "building, 2 s: body 'part': particles, step 3 of 40"
        BUILD.info("time step")
        clock.now += 1.0
        assert line.text().plain == "building, 3 s: time step"
        tell_built("built %d particles", 8)
        assert line.text().plain == ""
        clock.now += 50.0
        BUILD.debug("of a run")  # of no build
        BUILD.info("boundaries and effects")
        assert line.text().plain == ""  # another has just begun
    clock.now += 5.0
    BUILD.info("unheard")
    assert "boundaries" in line.text().plain


def test_builds_are_heard_in_the_block_only() -> None:
    level, handlers = BUILD.level, list(BUILD.handlers)
    with BuildLine(Clock()).listening():
        assert BUILD.isEnabledFor(logging.DEBUG)
    assert (BUILD.level, list(BUILD.handlers)) == (level, handlers)


@pytest.mark.parametrize("verb", ["run", "explain", "plot"])
def test_a_terminal_shows_what_a_verb_builds(
    verb: str,
    tmp_path: Path,
    terminal: io.StringIO,
    clock: Clock,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "pull.toml").write_text(SCENE_TOML)
    _slow(monkeypatch, clock)
    done = solidsph(verb, "pull.toml", cwd=tmp_path)
    assert done.returncode == 0
    shown = terminal.getvalue()
    assert re.search(r"building, \d+ s: body '\w+': particles", shown)
    assert "building" not in done.stdout


@pytest.mark.parametrize("words", [("-q",), ("--json",)])
def test_nothing_of_it_if_not_wanted(
    words: tuple[str, ...],
    tmp_path: Path,
    terminal: io.StringIO,
    clock: Clock,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "pull.toml").write_text(SCENE_TOML)
    _slow(monkeypatch, clock)
    assert solidsph("run", "pull.toml", *words, cwd=tmp_path).returncode == 0
    assert "building" not in terminal.getvalue()


def test_nothing_of_it_without_a_terminal(
    tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pull.toml").write_text(SCENE_TOML)
    monkeypatch.setattr("solidsph.commands.console.clock.monotonic", clock)
    _slow(monkeypatch, clock)
    done = solidsph("run", "pull.toml", cwd=tmp_path)
    assert done.returncode == 0
    assert "building" not in done.stderr + done.stdout


def test_every_stage_is_told_to_a_program_that_listens(caplog: pytest.LogCaptureFixture) -> None:
    hole = {"type": "disc", "radius": 0.2, "centre": [0.5, 0.5]}
    square = {"type": "box", "lengths": [1.0, 1.0]}
    shape = {"type": "difference", "of": square, "minus": hole}
    builder = Simulation.builder().body("sheet", shape=shape, spacing=0.1)
    builder = builder.material("neo-hookean", **SOFT).duration(1e-3)
    with caplog.at_level(logging.INFO, "solidsph"):
        builder.build()
    told = [record.getMessage() for record in caplog.records]
    assert told[:-1] == [
        "body 'sheet': particles",
        "body 'sheet': which neighbours see each other",
        "body 'sheet': gradient 'consistent'",
        "boundaries and effects",
        "weights of neighbours",
        "time step",
    ]
    assert told[-1].startswith("built ")


def test_a_build_in_python_is_silent(capfd: pytest.CaptureFixture[str]) -> None:
    box(2).build()
    assert capfd.readouterr() == ("", "")


def _slow(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    """Let every stage take two seconds of the clock, after which displays are drawn again."""
    begin, hear = Progress.start, BuildLine.emit
    displays: list[Progress] = []

    def start(self: Progress) -> None:
        displays.append(self)
        begin(self)

    def emit(self: BuildLine, record: logging.LogRecord) -> None:
        hear(self, record)
        clock.now += 2.0
        for display in displays:
            display.refresh()

    monkeypatch.setattr(Progress, "start", start)
    monkeypatch.setattr(BuildLine, "emit", emit)
