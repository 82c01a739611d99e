"""STEP files, whose exact surfaces Gmsh turns into triangles."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from solidsph.maths.arrays import Array, Indices
from solidsph_builtin.shapes._libraries import geometry_library
from solidsph_builtin.shapes._mesh_repair import turned

# Gmsh's own unit, whatever that of the file is [m].
_UNIT = 1e-3

# Triangles around a full circle.
_AROUND = 64


def triangulated(data: bytes, suffix: str) -> tuple[Array, Indices, list[str]]:
    """Points (m, 3), triangles (k, 3) and the number of the surface of each, as `surface-1`.

    Lengths are in m, whatever the unit of the file.

    Raises:
        SceneError: Gmsh is not installed.
        ValueError: the content is no STEP file with a closed body.
    """
    if not data.lstrip().startswith(b"ISO-10303-21"):
        raise ValueError("it does not begin with 'ISO-10303-21'")
    gmsh = geometry_library("gmsh", "step")
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    before = gmsh.model.getCurrent()
    gmsh.model.add("solidsph")
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _AROUND)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"body{suffix}"
            path.write_bytes(data)
            with _silent():
                gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        if not gmsh.model.getEntities(3):
            raise ValueError("there is no solid body in it")
        gmsh.model.mesh.generate(2)
        return _triangles(gmsh)
    except ValueError:
        raise
    except Exception as cause:  # all that Gmsh raises
        raise ValueError("Gmsh cannot read it; is it complete?") from cause
    finally:
        gmsh.model.remove()
        gmsh.finalize() if ours else gmsh.model.setCurrent(before)


@contextmanager
def _silent() -> Iterator[None]:
    """Keep what the reader of STEP files prints, past Python, off the terminal."""
    kept = [os.dup(stream) for stream in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, own in zip((1, 2), kept, strict=True):
            os.dup2(own, stream)
            os.close(own)
        os.close(nowhere)


def _triangles(gmsh: object) -> tuple[Array, Indices, list[str]]:
    mesh, model = gmsh.model.mesh, gmsh.model  # type: ignore[attr-defined]
    tags, coordinates, _ = mesh.getNodes()
    points = _UNIT * np.asarray(coordinates, dtype=np.float64).reshape(-1, 3)
    place = np.zeros(int(tags.max()) + 1, dtype=np.intp)
    place[tags.astype(np.intp)] = np.arange(len(tags))
    corners, groups = [], []
    for _, surface in model.getBoundary(model.getEntities(3), combined=True, oriented=False):
        _, nodes = mesh.getElementsByType(2, surface)
        corners.append(place[np.asarray(nodes, dtype=np.intp)].reshape(-1, 3))
        groups += [f"surface-{surface}"] * len(corners[-1])
    # Those of a surface run as it was drawn, whichever side the body is on.
    return points, turned(points, np.concatenate(corners)), groups
