"""With --json there is one object on the standard output, whatever the outcome."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from solidsph import Record
from solidsph.assembly import step_size
from solidsph.cli import main
from tests.helpers.scenes import SCENE_TOML
from tests.watch.test_soundness import column, plain


@pytest.fixture
def said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Any:
    """Runs the command in a folder of its own: exit code, the object, and the standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> tuple[int, dict[str, Any], str]:
        monkeypatch.setattr(sys, "argv", ["solidsph", *words, "--json"])
        with pytest.raises(SystemExit) as end:
            main()
        told = capsys.readouterr()
        return int(end.value.code or 0), json.loads(told.out), told.err

    return run


def written(text: str) -> str:
    Path("scene.toml").write_text(text)
    return "scene.toml"


def test_finished(said: Any) -> None:
    code, told, _ = said("run", written(SCENE_TOML))
    assert (code, told["outcome"], told["exit code"]) == (0, "finished", 0)
    assert told["warnings"] == [] or all(isinstance(one, str) for one in told["warnings"])
    assert "kinetic energy [J]" in told["final"]


def test_unsound(said: Any) -> None:
    # Not watched: the watchdog would end it before its energies are judged.
    code, told, err = said("run", written(plain().scene().to_toml()), "--no-watch")
    assert (code, told["outcome"], told["exit code"]) == (1, "unsound", 1)
    assert "do not add up" in told["error"]
    assert told["error"] in err
    assert "energy residual [J]" in told["final"]
    with Record(told["record"]) as record:
        assert record.outcome == f"unsound: {told['error']}"


def test_diverged(said: Any) -> None:
    scene = written(SCENE_TOML.replace("1e3*min(t/0.005, 1)", "1e9*t"))
    code, told, _ = said("run", scene)
    assert (code, told["outcome"]) == (1, "diverged")
    assert told["scene"] == scene
    assert "final" not in told
    assert told["warnings"]  # of the watchdog, or ahead of the run


def test_interrupted(said: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("solidsph.commands.run.run_watched", interrupted)
    code, told, _ = said("run", written(SCENE_TOML))
    assert (code, told["outcome"]) == (130, "interrupted")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("run", "missing.toml"), "cannot be read"),
        (("run",), "missing argument"),
        (("run", "--bogus", "x"), "no such option"),
        (("explain", "missing.toml"), "cannot be read"),
        (("check", "cubic-splin"), "did you mean"),
        (("resume", "missing.h5"), "missing.h5"),
        (("cost", "nothing-known"), "nothing-known"),
    ],
)
def test_invalid_input(said: Any, words: tuple[str, ...], told: str) -> None:
    code, found, _ = said(*words)
    assert (code, found["outcome"], found["exit code"]) == (2, "invalid input", 2)
    assert told in found["error"]
    assert found["problems"]


def test_every_problem_is_listed(said: Any) -> None:
    text = SCENE_TOML.replace("neo-hookean", "nothing").replace("1e3*min", "1e3*mim")
    code, told, _ = said("run", written(text + '\n[[effect]]\ntype = "mas-damping"\n'))
    assert code == 2
    assert len(told["problems"]) >= 2


def test_writing_a_scene_is_told(said: Any) -> None:
    code, told, _ = said("run", written(SCENE_TOML), "--write", "again.toml")
    assert (code, told["files"]) == (0, ["again.toml"])


def test_the_column_by_the_command(said: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_size, "safe_step", lambda *scene: None)  # the CFL step is too long
    long_steps = column().scheme("corrected").integrator("velocity-verlet", time_step_factor=0.5)
    code, told, _ = said("run", written(long_steps.scene().to_toml()))
    assert (code, told["outcome"]) == (1, "unsound")
    assert "critical step" in told["error"]
