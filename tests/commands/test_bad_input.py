"""Whatever is wrong with what a verb is given: one line that says so and what to do."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML

CASES = {
    # Scenes
    ("run", "missing.toml"): "there is no such file; did you mean",
    ("cost", "missing.toml"): "there is no such file; did you mean",
    ("explain", "missing.toml"): "there is no such file; did you mean",
    ("run", "broken.toml"): "broken.toml is not valid TOML: ",
    ("run", "empty.toml"): "--write scene.toml` writes an example",
    ("run", "latin.toml"): "it is not in UTF-8",
    ("run", "word.toml"): "unknown key 'duraton'; did you mean 'duration'?",
    ("cost", "type.toml"): "duration must be a number, got 'long'",
    ("run", "folder.toml"): "it is a folder; give a scene file",
    ("run", "csm2"): "unknown case 'csm2'; did you mean 'csm",
    ("run", "s.toml", "--set", "spacing"): "is not of the form name=value",
    ("run", "s.toml", "--set", "colour=1"): "no such word of a scene",
    # Records
    ("plot", "none.h5"): "there is no record none.h5; check the path, or run the scene first",
    ("view", "none.h5"): "there is no record none.h5; check the path, or run the scene first",
    ("resume", "none.h5"): "there is no record none.h5; check the path, or run the scene first",
    ("plot", "note.h5"): "note.h5 is not an HDF5 file, so no record of solidsph",
    # Pictures of scenes
    (
        "plot",
        "note.txt",
    ): "'note.txt' is no record, and no scene either: note.txt is not",
    ("plot", "broken.toml"): "broken.toml is not valid TOML",
    ("plot", "s.toml", "--set", "spacing=-2"): "spacing must be a length in metres, got -2",
    ("plot", "s.toml", "--output", "s.gif"): "a picture ends in .png, .svg, .pdf",
    ("plot", "s.toml", "--output", "s.toml/x.png"): "check the path, its permissions and the disk",
    ("plot", "s.toml", "--field", "velocity"): "--field colours a record, and 's.toml' is a scene",
    ("plot", "note.h5", "--set", "spacing=1"): "--set changes a scene, and 'note.h5' holds records",
    ("plot", "falling-edge"): "the case 'falling-edge' has no scene to draw",
    ("plot", "folder.toml"): "there is no record (*.h5) in the folder folder.toml; check the path",
    ("run", "s.toml", "-q", "--output", "note.h5"): "it is not replaced: choose another place",
    ("run", "s.toml", "-q", "--output", "s.toml/x"): "choose a path in a folder that you may write",
    ("run", "s.toml", "--write", "s.toml/x"): "check the path, its permissions and the disk",
    # Verbs and options
    ("rnu",): "no such command 'rnu'; did you mean 'run'?; see: solidsph --help",
    ("run",): "missing argument 'SCENE|-|CASE'; see: solidsph run --help",
    ("run", "s.toml", "--wach"): "'--watch'?); see: solidsph run --help",
    ("run", "s.toml", "--accuracy"): "requires an argument; see: solidsph run --help",
    ("run", "s.toml", "--roll-back", "-1"): "is not in the range x>=0; see: solidsph run --help",
    ("run", "s.toml", "--receipts-of", "u"): "add --receipts",
    ("stability", "s.toml"): "with: solidsph run s.toml --watch",
    ("stability", "-"): "with: solidsph run - --watch",
    ("check", "nothing"): "no installed part is called 'nothing'; list them: solidsph plugins",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    files = {
        "s.toml": SCENE_TOML,
        "broken.toml": 'title = "x',
        "empty.toml": "",
        "word.toml": SCENE_TOML.replace("duration", "duraton"),
        "type.toml": SCENE_TOML.replace("duration = 0.01", 'duration = "long"'),
        "note.h5": "a note",
        "note.txt": "a note",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "latin.toml").write_bytes(b'title = "gr\xfc\xdfe"')
    (tmp_path / "folder.toml").mkdir()
    return tmp_path


def assert_one_line(told: str, message: str) -> None:
    assert told.startswith("error: ")
    assert told.count("\n") == 1
    assert message in told


@pytest.mark.parametrize(("words", "message"), CASES.items(), ids=lambda value: str(value)[:40])
def test_one_line_and_a_remedy(words: tuple[str, ...], message: str, folder: Path) -> None:
    before = sorted(path.name for path in folder.iterdir())
    done = solidsph(*words, cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert_one_line(done.stderr, message)
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is full")
def test_results_that_cannot_be_written(folder: Path) -> None:
    (folder / "out.toml").symlink_to("/dev/full")
    done = solidsph("run", "s.toml", "--write", "out.toml", cwd=folder)
    assert done.returncode == 2
    assert_one_line(done.stderr, "No space left on device; check the path, its permissions")


@pytest.mark.parametrize("verb", ["run", "cost", "explain"])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        (b"", "the standard input is empty; `solidsph run CASE --write"),
        (b"title = ", "the standard input is not valid TOML"),
        (b'title = "gr\xfc\xdfe"', "the standard input cannot be read: it is not in UTF-8"),
        (SCENE_TOML.replace("duration", "duraton").encode(), "did you mean 'duration'?"),
    ],
)
def test_the_standard_input(
    verb: str, given: bytes, message: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(given)))
    done = solidsph(verb, "-", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert_one_line(done.stderr, message)


def test_a_scene_from_the_standard_input(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for words, place in (
        (("run", "-", "-q"), "results/standard-input/record.h5"),
        (("cost", "-", "--of", "strain energy [J]"), "results/cost/standard-input"),
        (("explain", "-"), "s.toml"),
    ):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(SCENE_TOML.encode())))
        done = solidsph(*words, cwd=folder)
        assert done.returncode == 0, done.stderr
        assert (folder / place).exists()
