"""Files that hold no body: one message each, exit code 2, and nothing executed."""

from __future__ import annotations

import os
import pickle
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph_builtin.shapes.mesh import Mesh
from tests.commands.test_cli import solidsph
from tests.helpers.mesh_bodies import blob, exported, file_scene

# What no broken file may take: that of ten million triangles has 5e8 bytes.
BYTES = 1e8


def box() -> trimesh.Trimesh:
    return trimesh.creation.box([1.0, 0.8, 0.6])


def changed(change: Callable[[trimesh.Trimesh], trimesh.Trimesh]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        exported(change(box()), path)

    return write


def with_faces(mesh: trimesh.Trimesh, faces: Array) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def flipped_one(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    faces = mesh.faces.copy()
    faces[3] = faces[3][::-1]
    return with_faces(mesh, faces)


def nan(path: Path) -> None:
    text = box().export(file_type="obj")
    path.write_text(re.sub(r"v \S+", "v nan", text, count=1))


def nested(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    inner = box()
    inner.apply_scale(0.5)
    return trimesh.util.concatenate([mesh, inner])


def crossing(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    other = box()
    other.apply_translation([0.4, 0.1, 0.2])
    return trimesh.util.concatenate([mesh, other])


def beyond_its_points(path: Path) -> None:
    path.write_text(box().export(file_type="obj").replace("f 1//1", "f 99//1", 1) + "\nf 1 2 99\n")


def ten_million(path: Path) -> None:
    """A binary file of the size that ten million triangles have."""
    with path.open("wb") as file:
        file.write(bytes(80) + (10_000_000).to_bytes(4, "little"))
        file.truncate(84 + 50 * 10_000_000)


def many_announced(path: Path) -> None:
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 0\nelement face 4000000000\nend_header\n"
    )


class Bomb:
    """What a pickle of it does when it is loaded."""

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return os.mkdir, ("executed",)


BROKEN: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "open": (
        "a.stl",
        changed(lambda m: with_faces(m, m.faces[:-1])),
        r"not closed: 3 edges .* at \(.*\) m; set repair = true",
    ),
    "flipped": ("a.ply", changed(flipped_one), "some of its triangles are inverted: along 3 edges"),
    "inverted": ("a.stl", changed(lambda m: with_faces(m, m.faces[:, ::-1])), "it is inverted"),
    "twice": (
        "a.ply",
        changed(lambda m: with_faces(m, np.vstack([m.faces, m.faces[:1]]))),
        "1 triangles are there twice",
    ),
    "not a number": ("a.obj", nan, "corners that are not finite"),
    "nested": ("a.stl", changed(nested), "within another, with normals that say it is no hole"),
    "crossing": ("a.stl", changed(crossing), r"it crosses itself at \(.*\) m"),
    "flat": ("a.stl", changed(lambda m: with_faces(m, m.faces[:2])), "not closed: 4 edges"),
    "empty": ("a.stl", Path.touch, "it is empty"),
    "no triangles": ("a.stl", lambda p: p.write_text("solid a\nendsolid a\n"), "no triangles"),
    "truncated": (
        "a.stl",
        lambda p: p.write_bytes(box().export(file_type="stl")[:500]),
        "should have 684 bytes by its header, not 500",
    ),
    "truncated text": (
        "a.stl",
        lambda p: p.write_text(box().export(file_type="stl_ascii")[:900]),
        "it ends within a facet",
    ),
    "truncated ply": (
        "a.ply", lambda p: p.write_bytes(box().export(file_type="ply")[:-40]), "length"
    ),
    "ten million": ("a.stl", ten_million, "has 500,000,084 bytes, at most 268,435,456 are read"),
    "many announced": ("a.ply", many_announced, "4,000,000,000 triangles, at most 2,000,000"),
    "wrong suffix": ("a.stl", lambda p: p.write_bytes(box().export(file_type="ply")), "no text"),
    "no suffix": ("a", Path.touch, "no mesh files end in nothing"),
    "unknown suffix": ("a.exe", Path.touch, "no mesh files end in '.exe'; use one of stl, obj"),
    "a folder": ("a.stl", Path.mkdir, "it is a folder, not a regular file"),
    "a pipe": ("a.stl", os.mkfifo, "it is a pipe, not a regular file"),
    "absent": ("a.stl", lambda p: None, "No such file"),
    "a pickle": ("a.stl", lambda p: p.write_bytes(pickle.dumps(Bomb())), "no text"),
    "a pickle as obj": ("a.obj", lambda p: p.write_bytes(pickle.dumps(Bomb())), "triangles"),
    "a pickle as msh": ("a.msh", lambda p: p.write_bytes(pickle.dumps(Bomb())), "Error"),
    "a pickle as vtu": ("a.vtu", lambda p: p.write_bytes(pickle.dumps(Bomb())), "be read as vtu"),
    "a pickle as step": ("a.step", lambda p: p.write_bytes(pickle.dumps(Bomb())), "ISO-10303-21"),
    "no step": ("a.step", lambda p: p.write_text("ISO-10303-21;\nrubbish"), "Gmsh cannot read it"),
    "corners beyond": ("a.obj", beyond_its_points, "Error|corner"),
    "random": ("a.msh", lambda p: p.write_bytes(np.random.default_rng(0).bytes(5000)), "Error"),
    "abaqus without cells": ("a.inp", lambda p: p.write_text("*NODE\n1, 0, 0, 0\n"), "triangles"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files(tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    file, write, message = BROKEN[name]
    write(tmp_path / file)
    (tmp_path / "scene.toml").write_text(file_scene("mesh", file))
    tracemalloc.start()
    try:
        result = solidsph("run", "scene.toml", cwd=tmp_path)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert result.returncode == 2
    said = " ".join((result.stdout + result.stderr).split())
    assert re.search(message, said), said
    assert capfd.readouterr() == ("", "")
    assert said.count("shape 'mesh': file") == 1
    assert "Traceback" not in said
    assert most < BYTES
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("name", ["open", "flipped", "inverted", "twice", "nested"])
def test_what_can_be_repaired(tmp_path: Path, name: str) -> None:
    file, write, _ = BROKEN[name]
    write(tmp_path / file)
    shape = Mesh(tmp_path / file, repair=True)
    hollow = 0.125 if name == "nested" else 0.0
    assert shape.volume() == pytest.approx(0.48 * (1.0 - hollow), rel=1e-6)


def test_holes_and_gaps_of_rounding_are_closed() -> None:
    """A hole with seven edges in a round surface, and corners that differ in the last digits."""
    mesh = trimesh.creation.icosphere(3)
    loose = mesh.vertices[mesh.faces].reshape(-1, 3)
    loose = loose + np.random.default_rng(0).uniform(-1e-8, 1e-8, loose.shape)
    kept = np.delete(np.arange(len(mesh.faces)), [0, 1, 2, 3, 700])
    faces = np.arange(len(loose)).reshape(-1, 3)[kept]
    with pytest.raises(SceneError, match="not closed"):
        Mesh(vertices=loose, triangles=faces)
    shape = Mesh(vertices=loose, triangles=faces, repair=True)
    assert shape.volume() == pytest.approx(mesh.volume, rel=1e-3)


def test_parts_that_touch_in_an_edge_are_a_body() -> None:
    """Four triangles at an edge are no fault."""
    one, two = box(), box()
    two.apply_translation([1.0, 0.8, 0.0])
    mesh = trimesh.util.concatenate([one, two])
    assert Mesh(vertices=mesh.vertices, triangles=mesh.faces).volume() == pytest.approx(0.96)


def test_sound_surfaces_of_many_triangles_are_not_refused() -> None:
    mesh = blob(5)
    shape = Mesh(vertices=mesh.vertices, triangles=mesh.faces)
    assert shape.volume() == pytest.approx(mesh.volume, rel=1e-12)


@pytest.mark.parametrize("repair", [False, True])
def test_bodies_that_touch_are_no_hole(repair: bool) -> None:
    beside = trimesh.creation.box([1.0, 1.0, 1.0]).apply_translation([1.0, 0.0, 0.0])
    both = trimesh.util.concatenate([trimesh.creation.box([1.0, 1.0, 1.0]), beside])
    with pytest.raises(SceneError, match=r"parts of it touch at \(0\.5, .* the shape 'union'"):
        Mesh(vertices=both.vertices, triangles=both.faces, repair=repair)


def test_a_file_that_is_not_there_is_told_with_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError, match=f"No such file; its path begins in {tmp_path}"):
        Mesh(file="a.stl")
