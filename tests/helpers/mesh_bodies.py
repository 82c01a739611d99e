"""Bodies of triangles, made by public libraries."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import igl
import numpy as np
import trimesh

from solidsph_builtin.shapes.mesh import Mesh


@contextmanager
def modelled(build: Callable[[Any], None], around: int = 32) -> Iterator[Any]:
    """Gmsh with the surface of a body that `build` makes of its shapes, in triangles."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", around)
        build(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(2)
        yield gmsh
    finally:
        gmsh.finalize()


def gear(occ: Any) -> None:
    """Twelve teeth, and a hole for the shaft."""
    angles = np.arange(48) * np.pi / 24.0
    radii = np.where(np.arange(48) % 4 < 2, 1.0, 0.8)
    points = [
        occ.addPoint(r * np.cos(a), r * np.sin(a), 0.0) for r, a in zip(radii, angles, strict=True)
    ]
    lines = [occ.addLine(points[i - 1], points[i]) for i in range(48)]
    rim = occ.addCurveLoop(lines)
    hole = occ.addCurveLoop([occ.addCircle(0.0, 0.0, 0.0, 0.3)])
    occ.extrude([(2, occ.addPlaneSurface([rim, hole]))], 0.0, 0.0, 0.5)


def elbow(occ: Any) -> None:
    """A quarter of a bent pipe."""
    outer, inner = (occ.addDisk(1.5, 0.0, 0.0, r, r) for r in (0.5, 0.3))
    ring, _ = occ.cut([(2, outer)], [(2, inner)])
    occ.revolve(ring, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.5 * np.pi)


def bracket(occ: Any) -> None:
    """Two plates at a right angle, with a fillet between them and a hole in each."""
    foot, wall = occ.addBox(0.0, 0.0, 0.0, 1.0, 0.6, 0.2), occ.addBox(0.0, 0.0, 0.0, 0.2, 0.6, 0.8)
    (both, *_), _ = occ.fuse([(3, foot)], [(3, wall)])
    occ.synchronize()
    edge = [
        tag
        for dim, tag in occ.getEntities(1)
        if np.allclose(occ.getCenterOfMass(dim, tag), (0.2, 0.3, 0.2))
    ]
    (body, *_) = occ.fillet([both[1]], edge, [0.12])
    holes = [
        (3, occ.addCylinder(0.7, 0.3, -0.1, 0.0, 0.0, 0.4, 0.12)),
        (3, occ.addCylinder(-0.1, 0.3, 0.55, 0.4, 0.0, 0.0, 0.12)),
    ]
    occ.cut([body], holes)


def triangles_of(build: Callable[[Any], None]) -> trimesh.Trimesh:
    """The triangles of a model, with the body behind them."""
    with modelled(build) as gmsh:
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(2)
        points = np.asarray(coordinates).reshape(-1, 3)[np.argsort(tags)]
        corners = np.asarray(nodes, dtype=np.intp).reshape(-1, 3) - 1
    corners = igl.bfs_orient(corners)[0]
    mesh = trimesh.Trimesh(points, corners, process=True)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def hollow_box() -> trimesh.Trimesh:
    """Walls of four spacings around a cavity, which is a surface of its own."""
    outer, inner = trimesh.creation.box([1.0, 0.8, 0.6]), trimesh.creation.box([0.8, 0.6, 0.4])
    inner.invert()
    return trimesh.util.concatenate([outer, inner])


def blob(halvings: int) -> trimesh.Trimesh:
    """A round stone with dents, as a scanner gives it: 20 times 4 triangles to each halving."""
    ball = trimesh.creation.icosphere(halvings)
    x, y, z = np.asarray(ball.vertices).T
    radius = 1.0 + 0.15 * np.sin(3.0 * x) * np.cos(4.0 * y) + 0.1 * np.sin(5.0 * z)
    return trimesh.Trimesh(ball.vertices * radius[:, None], ball.faces, process=False)


@attrs.frozen
class Body:
    """A mesh, and the spacing that resolves it."""

    make: Callable[[], trimesh.Trimesh]
    spacing: float  # [m]

    def shape(self) -> Mesh:
        mesh = self.make()
        return Mesh(vertices=mesh.vertices, triangles=mesh.faces)


BODIES = {
    "gear": Body(lambda: triangles_of(gear), 0.06),
    "elbow": Body(lambda: triangles_of(elbow), 0.06),
    "torus": Body(lambda: trimesh.creation.torus(1.0, 0.3, 64, 32), 0.1),
    "bracket": Body(lambda: triangles_of(bracket), 0.04),
    "hollow box": Body(hollow_box, 0.05),
    "coarse sphere": Body(lambda: trimesh.creation.icosphere(2), 0.15),
    "sphere": Body(lambda: trimesh.creation.icosphere(3), 0.15),
    "fine sphere": Body(lambda: trimesh.creation.icosphere(5), 0.15),
    "blob": Body(lambda: blob(7), 0.15),
}


def exported(mesh: trimesh.Trimesh, path: Path) -> Path:
    """The mesh in a file of the kind that its name says."""
    mesh.export(path)
    return path


def file_scene(shape: str, file: str) -> str:
    """A scene of one body whose shape is read from a file."""
    return f"""
duration = 1.0
[body.part]
spacing = 0.1
shape = {{type = "{shape}", file = "{file}"}}
[material]
type = "linear-elastic"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
"""
