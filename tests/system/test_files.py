"""A file that a scene or a user names is a regular one of bounded size, read once and whole."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from solidsph import Scene, SceneError, Simulation
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.system.files import content
from tests.helpers.fuzzing import within
from tests.helpers.scenes import SCENE_TOML

SECONDS = 60.0  # what waits for a pipe waits for ever


def with_points(file: Path | str) -> SceneBuilder:
    return (
        Simulation.builder()
        .body(
            "bar",
            shape={"type": "interval", "length": 1.0},
            spacing=0.25,
            discretisation={"type": "points", "file": str(file)},
        )
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3)
        .duration(0.01)
    )


def refusal(act) -> str:
    with within(SECONDS), pytest.raises(Exception, match=r"regular|bytes|a folder") as caught:
        act()
    return str(caught.value)


READERS = {
    "scene": lambda path: Scene.read(path),
    "points": lambda path: with_points(path).build(),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(
    ("kind", "told"), [("pipe", "a pipe"), ("device", "a device"), ("folder", "a folder")]
)
def test_what_is_no_regular_file_is_not_read(
    tmp_path: Path, reader: str, kind: str, told: str
) -> None:
    path = {"pipe": tmp_path / "pipe", "device": Path("/dev/zero"), "folder": tmp_path}[kind]
    if kind == "pipe":
        os.mkfifo(path)
    (tmp_path / "link").symlink_to(path)
    for one in (path, tmp_path / "link"):
        message = refusal(lambda one=one: READERS[reader](one))
        assert f"it is {told}" in message
        assert str(one) in message


@pytest.mark.parametrize("reader", READERS)
def test_a_file_of_no_bounds_is_not_read(tmp_path: Path, reader: str) -> None:
    """A terabyte of zeros that takes no place on the disk."""
    path = tmp_path / "large"
    path.touch()
    os.truncate(path, 2**40)
    assert "1,099,511,627,776 bytes, at most" in refusal(lambda: READERS[reader](path))


def test_links_to_regular_files_are_followed(tmp_path: Path) -> None:
    (tmp_path / "real.toml").write_text(SCENE_TOML)
    (tmp_path / "scene.toml").symlink_to(tmp_path / "real.toml")
    assert Scene.read(tmp_path / "scene.toml") == Scene.from_toml(SCENE_TOML)
    np.savetxt(tmp_path / "real.csv", [0.125, 0.375, 0.625, 0.875])
    (tmp_path / "points.csv").symlink_to(tmp_path / "real.csv")
    assert with_points(tmp_path / "points.csv").build().particles.count == 4


@pytest.mark.parametrize("later", [404, 396])
def test_a_file_that_changes_meanwhile_is_told_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, later: int
) -> None:
    """Somebody writes on while it is read: what was there would be a part of the points."""
    path, sizes = tmp_path / "points.csv", iter((400, later))
    path.write_bytes(b"0.5\n" * 100)

    def fstat(handle: int) -> SimpleNamespace:
        return SimpleNamespace(st_mode=os.fstat(handle).st_mode, st_size=next(sizes))

    monkeypatch.setattr("solidsph.system.files.os", SimpleNamespace(**{**vars(os), "fstat": fstat}))
    with pytest.raises(OSError, match="changed while it was read; wait"):
        content(path, 10**6)


@pytest.mark.parametrize("shape", [(10**9, 10**9), (2**62,), (10**6, 3)])
def test_an_array_that_claims_more_than_its_file_has(tmp_path: Path, shape: tuple) -> None:
    path = tmp_path / "points.npy"
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(
            file, {"descr": "<f8", "fortran_order": False, "shape": shape}
        )
        file.write(bytes(80))
    with within(SECONDS), pytest.raises(Exception, match="cannot read positions") as caught:
        with_points(path).build()
    assert "BuildError" in type(caught.value).__name__ or isinstance(caught.value, SceneError)
