"""What is said beside the results: by -q, -v and -vv, and to a program's own logging."""

from __future__ import annotations

import logging
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML, box


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "pull.toml"
    path.write_text(SCENE_TOML)
    assert solidsph("run", "pull.toml", cwd=tmp_path).returncode == 0  # a record to be replaced
    return path


def test_results_and_warnings_by_default(scene: Path) -> None:
    done = solidsph("run", "pull.toml", cwd=scene.parent)
    assert done.returncode == 0
    assert "energy residual" in done.stdout
    assert done.stderr.startswith("warning: results/pull/record.h5 holds a finished run")
    assert "begins" not in done.stderr


@pytest.mark.parametrize("where", ["before", "after", "short"])
def test_quiet_leaves_results_and_errors(scene: Path, where: str) -> None:
    words = {
        "before": ("--quiet", "run", "pull.toml"),
        "after": ("run", "pull.toml", "--quiet"),
        "short": ("run", "-q", "pull.toml"),
    }[where]
    done = solidsph(*words, cwd=scene.parent)
    assert (done.returncode, done.stderr) == (0, "")
    assert "energy residual" in done.stdout
    scene.unlink()
    done = solidsph(*words, cwd=scene.parent)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")


def test_verbose_tells_what_is_done(scene: Path) -> None:
    for words in (("-v", "run", "pull.toml"), ("run", "pull.toml", "--verbose")):
        done = solidsph(*words, cwd=scene.parent)
        assert done.returncode == 0
        for told in ("built 45 particles with", "the run begins: ", "recording into results/pull"):
            assert told in done.stderr
        assert ": particles\n" in done.stderr
        assert "the run has ended: finished" in done.stderr
        assert "output at" not in done.stderr
        assert "bytes touched" in done.stdout
    for words in (("-vv", "run", "pull.toml"), ("-v", "run", "-v", "pull.toml")):
        told = solidsph(*words, cwd=scene.parent).stderr
        assert "run.motion: output at t = 0.01 s, step" in told
    done = solidsph("-v", "run", "pull.toml", "--json", cwd=scene.parent)
    assert done.stdout.startswith("{")  # what is told is not among the facts


def test_more_and_less_at_once_is_refused(scene: Path) -> None:
    done = solidsph("-v", "run", "pull.toml", "-q", cwd=scene.parent)
    assert done.returncode == 2
    assert "-q shows less and -v more; give one of them" in done.stderr


def test_a_program_hears_by_its_own_logging(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, "solidsph"):
        box(2).boundary("clamp", where="left").outputs(4).build().run()
    told = [record.getMessage() for record in caplog.records]
    assert told[0].endswith("particles")
    assert sum(line.startswith("built 36 particles") for line in told) == 1
    assert sum(line.startswith("output at t = ") for line in told) == 4
    assert told[-1] == "the run has ended: finished"
    assert all(record.levelno <= logging.INFO for record in caplog.records)


def test_a_program_without_logging_hears_nothing() -> None:
    code = (
        "import logging, solidsph\n"
        "logging.getLogger('solidsph.anything').warning('unheard')\n"
        "print(logging.getLogger('solidsph').handlers)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert "NullHandler" in done.stdout
