"""Files that a scene names: their paths begin in the folder of the scene file."""

from __future__ import annotations

import io
import tomllib
from pathlib import Path

import numpy as np
import pytest

import solidsph
from solidsph import Simulation
from solidsph.errors import BuildError
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.scene_case import SceneCase
from tests.commands.test_cli import solidsph as run_command

_REST = """
duration = 1e-5
outputs = 2
material = {type = "neo-hookean", youngs_modulus = 1e6, poissons_ratio = 0.3, density = 1000.0}
"""

_TETRAHEDRON = """
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
"""

KINDS = {
    "mesh": (
        'shape = {type = "mesh", file = "FILE"}\ndiscretisation = "lattice"',
        *("body.obj", _TETRAHEDRON),
    ),
    "outline": ('shape = {type = "outline", file = "FILE"}', "body.csv", "0,0\n1,0\n1,1\n0,1\n"),
    "a shape in another": (
        'shape = {type = "extruded", length = 0.5, of = {type = "outline", file = "FILE"}}\n'
        'discretisation = "lattice"',
        *("body.csv", "0,0\n1,0\n1,1\n0,1\n"),
    ),
    "spacing": (
        'shape = {type = "interval", length = 1.0}\nspacing = {file = "FILE"}',
        *("body.csv", "X,spacing\n0,0.02\n1,0.1\n"),
    ),
    "points": (
        'shape = {type = "interval", length = 1.0}\n'
        'discretisation = {type = "points", file = "FILE"}',
        *("body.csv", "".join(f"{x}\n" for x in np.linspace(0.125, 0.875, 4))),
    ),
}


def written(folder: Path, kind: str) -> Path:
    """A scene in a folder of its own, whose file is in another beside it."""
    table, name, text = KINDS[kind]
    (folder / "scenes/parts").mkdir(parents=True)
    (folder / "scenes/parts" / name).write_text(text)
    scene = folder / "scenes/scene.toml"
    body = table.replace("FILE", f"parts/{name}")
    spacing = "" if "spacing" in body else "spacing = 0.25"
    scene.write_text(f"{_REST}[body.it]\n{spacing}\n{body}\n")
    return scene


@pytest.mark.parametrize("kind", KINDS)
def test_a_path_begins_in_the_folder_of_the_scene(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, kind)
    counts = []
    for folder, path in (("", "scenes/scene.toml"), ("scenes", "scene.toml"), ("scenes/parts", "")):
        monkeypatch.chdir(tmp_path / folder)
        read = Scene.read(path or tmp_path / "scenes/scene.toml")
        counts.append(Simulation.builder(read).build().particles.count)
    assert counts == [counts[0]] * 3
    text = (tmp_path / "scenes/scene.toml").read_text()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BuildError, match="No such file"):  # text is from no folder
        Simulation.builder(Scene.from_toml(text)).build()
    monkeypatch.chdir(tmp_path / "scenes")
    assert Simulation.builder(Scene.from_toml(text)).build().particles.count == counts[0]


@pytest.mark.parametrize("kind", ["points", "outline", "spacing"])
def test_a_run_is_resumed_from_anywhere(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, kind)
    monkeypatch.chdir(tmp_path)
    record = tmp_path / "record.h5"
    Simulation.builder(Scene.read("scenes/scene.toml")).build().run(record=record)
    with Record(record) as kept:
        assert any(name.startswith("file scenes/parts/") for name in kept.versions)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert solidsph.resume(record, until=2e-5).state.time >= 2e-5


def test_a_scene_is_written_for_its_new_place(tmp_path: Path) -> None:
    written(tmp_path, "outline")
    words = ("run", "scenes/scene.toml", "--write", "copies/again.toml")
    assert run_command(*words, cwd=tmp_path).returncode == 0
    table = tomllib.loads((tmp_path / "copies/again.toml").read_text())
    assert Path(table["body"]["it"]["shape"]["file"]) == Path("../scenes/parts/body.csv")
    assert run_command("explain", "copies/again.toml", cwd=tmp_path).returncode == 0


def test_the_standard_input_has_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = written(tmp_path, "outline").read_bytes()
    for folder, code in ((tmp_path / "scenes", 0), (tmp_path, 2)):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text)))
        assert run_command("explain", "-", cwd=folder).returncode == code


def test_a_reference_begins_in_the_folder_of_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = written(tmp_path, "points")
    (tmp_path / "scenes/curve.csv").write_text("0,0\n1,1\n")
    probe = '[[probe]]\nlabel = "end"\nquantity = "displacement x"\npoint = [0.9]\n'
    reference = '[[reference]]\nquantity = "end"\nfile = "curve.csv"\n'
    scene.write_text(scene.read_text() + probe + reference)
    monkeypatch.chdir(tmp_path)
    case = SceneCase.of(Scene.read("scenes/scene.toml"), [])
    assert len(case.references) == 1


def test_only_paths_are_changed(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    place = tmp_path / "other/plate.csv"
    scene.write_text(
        f'{_REST}[body.file]\nspacing = 0.25\ntags = {{file = "X < 0.5"}}\n'
        f'shape = {{type = "outline", file = {str(place)!r}}}\n'
    )
    body = Scene.read(scene).bodies["file"]
    assert body.tags == {"file": "X < 0.5"}
    assert body.shape == {"type": "outline", "file": str(place)}  # an absolute path stays
