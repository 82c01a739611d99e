"""Files of meshes: triangles, and the names of the groups that they are in."""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.shapes._libraries import geometry_library
from solidsph_builtin.shapes._mesh_cells import outer_triangles
from solidsph_builtin.shapes._step_files import triangulated

# Some 5 million triangles in binary STL, twice as many as are taken.
MOST_BYTES = 2**28
MOST_TRIANGLES = 2_000_000

# Types of Abaqus for plane stress, plane strain and rotational symmetry, by their points.
_PLANE = re.compile(rb"(?im)^(\*ELEMENT\b.*?TYPE\s*=\s*)(?:CPS|CPE|CPEG|CAX)([3468])\w*")
# The head of a surface and its lines: the name of a set of elements, and the face of each.
_SURFACE = re.compile(
    rb'(?im)^\*SURFACE\s*,.*?\bNAME\s*=\s*"?([^",\r\n]+).*\n((?:(?:\*\*|[^*]).*(?:\n|$))*)'
)
_FACE = re.compile(rb"(?im)^([^,\r\n]+),\s*S([1-6])\b")
_LEFT_OUT = re.compile(r"skipping unsupported element type '(C3D\w*)'")

# Bytes of a binary STL before its triangles, and of each.
_STL_HEAD, _STL_TRIANGLE = 84, 50


@attrs.frozen(eq=False)
class Soup:
    """Triangles as a file has them."""

    vertices: Array  # (m, 3) in the unit of the file
    corners: Indices  # (k, 3) vertices of each triangle
    groups: Sequence[str]  # (k,) the group that each is in; empty for none


def read_soup(data: bytes, suffix: str) -> Soup:
    """The triangles in the content of a file whose name ends in `suffix`, such as ".stl".

    Raises:
        SceneError: the library that reads such files is not installed.
        ValueError: the content is something else.
    """
    if suffix not in _READERS:
        known = ", ".join(name.lstrip(".") for name in _READERS)
        end = repr(suffix) if suffix else "nothing"
        raise ValueError(f"no mesh files end in {end}; use one of {known}")
    if not data:
        raise ValueError("it is empty")
    with (
        warnings.catch_warnings(),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
    ):
        warnings.simplefilter("ignore")
        soup = _READERS[suffix](data, suffix)
    if not len(soup.corners):
        raise ValueError("there are no triangles in it")
    if len(soup.corners) > MOST_TRIANGLES:
        raise ValueError(_too_many(len(soup.corners)))
    if soup.corners.min() < 0 or soup.corners.max() >= len(soup.vertices):
        raise ValueError(f"a triangle has a corner that is none of the {len(soup.vertices)} points")
    return soup


def _too_many(count: int) -> str:
    return f"it has {count:,} triangles, at most {MOST_TRIANGLES:,} are taken; make it coarser"


def _stl(data: bytes, suffix: str) -> Soup:
    count = int.from_bytes(data[_STL_HEAD - 4 : _STL_HEAD], "little")
    if len(data) != _STL_HEAD + _STL_TRIANGLE * count:
        if not data.lstrip().startswith(b"solid"):
            size = _STL_HEAD + _STL_TRIANGLE * count
            raise ValueError(
                "it is no text that begins with 'solid', and as a binary file it should have "
                f"{size:,} bytes by its header, not {len(data):,}"
            )
        if data.count(b"endfacet") != data.count(b"outer loop"):
            raise ValueError("it ends within a facet")
    elif count > MOST_TRIANGLES:
        raise ValueError(_too_many(count))
    return _by_trimesh(data, suffix)


def _ply(data: bytes, suffix: str) -> Soup:
    found = re.search(rb"element\s+face\s+(\d+)", data[:4096])
    if found and int(found[1]) > MOST_TRIANGLES:
        raise ValueError(_too_many(int(found[1])))
    return _by_trimesh(data, suffix)


def _obj(data: bytes, suffix: str) -> Soup:
    return _by_trimesh(data, suffix, split_groups=True, split_objects=True, skip_materials=True)


def _unreadable(cause: BaseException, suffix: str) -> ValueError:
    why = f" ({type(cause).__name__}: {cause})" if isinstance(cause, Exception) else ""
    return ValueError(f"it cannot be read as {suffix[1:]}{why}; is it complete, and of that kind?")


def _by_trimesh(data: bytes, suffix: str, **options: Any) -> Soup:
    """Read by trimesh, which executes nothing and opens no other file."""
    trimesh = geometry_library("trimesh")
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], process=False, **options)
    except Exception as cause:
        raise _unreadable(cause, suffix) from cause
    meshes = [
        (name, mesh) for name, mesh in scene.geometry.items() if len(getattr(mesh, "faces", ()))
    ]
    if not meshes:
        raise ValueError("there are no triangles in it")
    counts = np.cumsum([0, *(len(mesh.vertices) for _, mesh in meshes)])
    groups: list[str] = []
    for name, mesh in meshes:
        groups += [str(name) if len(meshes) > 1 else ""] * len(mesh.faces)
    return Soup(
        np.concatenate([np.asarray(mesh.vertices, dtype=np.float64) for _, mesh in meshes]),
        np.concatenate([m.faces + n for (_, m), n in zip(meshes, counts, strict=False)]),
        groups,
    )


def _by_meshlane(
    data: bytes, suffix: str, faces_of_sets: Mapping[str, Sequence[tuple[str, int]]] | None = None
) -> Soup:
    """Read by meshlane, whose readers take the path of a file only."""
    meshlane = geometry_library("meshlane")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"mesh{suffix}"
        path.write_bytes(data)
        said = io.StringIO()
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                mesh = meshlane.read(path, _FORMATS[suffix])
        except (Exception, SystemExit) as cause:  # meshlane ends the program where it fails
            raise _unreadable(cause, suffix) from cause
    # A body without some of its cells would have another surface.
    left_out = sorted(set(_LEFT_OUT.findall(said.getvalue())))
    if left_out:
        raise ValueError(
            f"solid elements of the type {', '.join(left_out)} are not read; use others, such as "
            "C3D4, C3D8, C3D10 or C3D20"
        )
    return Soup(*outer_triangles(mesh, faces_of_sets or {}))


def _abaqus(data: bytes, suffix: str) -> Soup:
    """With plane elements as the shells that have their points, and surfaces by element faces."""

    def renamed(found: re.Match[bytes]) -> bytes:
        degree = {b"3": b"S3", b"4": b"S4", b"6": b"STRI65", b"8": b"S8R"}
        return found[1] + degree[found[2]]

    surfaces = {
        found[1].decode(errors="replace"): [
            (cells.decode(errors="replace").strip(), int(face))
            for cells, face in _FACE.findall(found[2])
        ]
        for found in _SURFACE.finditer(data)
    }
    return _by_meshlane(_PLANE.sub(renamed, data), suffix, surfaces)


def _step(data: bytes, suffix: str) -> Soup:
    return Soup(*triangulated(data, suffix))


_FORMATS: Mapping[str, str] = {".msh": "gmsh", ".inp": "abaqus", ".vtu": "vtu"}
_READERS: Mapping[str, Callable[[bytes, str], Soup]] = {
    ".stl": _stl,
    ".obj": _obj,
    ".ply": _ply,
    **dict.fromkeys(_FORMATS, _by_meshlane),
    ".inp": _abaqus,
    ".step": _step,
    ".stp": _step,
}
