"""Meshed parts beside finite elements: how far off a displacement is, and how fast that falls.

    python benchmarks/meshed_parts.py                    some six minutes on one core
    python benchmarks/meshed_parts.py torus --across 4 8

Gmsh models a thick ball and a thick torus under pressure from inside, an eighth of each, and a
quarter bend of a pipe under its weight, clamped at one end. Our particles fill the triangles that
it makes of their surfaces, as a user's file would have them; quadratic tetrahedra of the same
models are the reference, and the ball has a closed form (Lame).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import log, pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import attrs
import gmsh
import numpy as np
from elements import Rest, Solid, neo_hookean
from skfem import ElementTetP2, FacetBasis, LinearForm, MeshTet2
from table import Table

from solidsph import Simulation
from solidsph.maths.arrays import Array, Mask
from solidsph.scene.scene_builder import SceneBuilder

MODULUS, RATIO, DENSITY = 1e6, 0.3, 1000.0
# So small that the answers are those of linear elasticity.
PRESSURE, WEIGHT = 10.0, 0.1

# Triangles of a surface are so much smaller than the spacing.
_FINER = 2.0

# Nodes of Gmsh's tetrahedra in the order of scikit-fem.
_ORDER = (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)


@attrs.frozen
class Part:
    """A body, what is asked of it, and how finely it is known."""

    model: Callable[[Any], None]
    thickness: float  # [m]
    inside: Callable[[Array], Mask]  # whether places (m, 3) on a curved face are on the inner one
    point: tuple[float, float, float]  # near where the displacement is asked for [m]
    axis: int
    cells: float  # size of the tetrahedra [m]
    exact: float | None = None  # [m]


def ball(occ: Any) -> None:
    outer, inner = (occ.addSphere(0, 0, 0, r, -1, 0, pi / 2, pi / 2) for r in (1.0, 0.5))
    occ.cut([(3, outer)], [(3, inner)])


def torus(occ: Any) -> None:
    rings = [[(2, occ.addDisk(1, 0, 0, r, r))] for r in (0.5, 0.25)]
    ring, _ = occ.cut(*rings)
    half, _ = occ.intersect(ring, [(2, occ.addRectangle(0, 0, 0, 2, 1))])
    occ.revolve(half, 0, 0, 0, 0, 1, 0, -pi / 2)


def elbow(occ: Any) -> None:
    rings = [[(2, occ.addDisk(1.5, 0, 0, r, r))] for r in (0.5, 0.2)]
    ring, _ = occ.cut(*rings)
    occ.revolve(ring, 0, 0, 0, 0, 1, 0, -pi / 2)


def _in_tube(X: Array) -> Mask:
    return np.hypot(np.hypot(X[:, 0], X[:, 2]) - 1.0, X[:, 1]) < 0.375


PARTS = {
    # u_r = p a^3 / (E (b^3 - a^3)) ((1 - 2 nu) a + (1 + nu) b^3 / (2 a^2)) at r = a.
    "ball": Part(
        ball,
        0.5,
        lambda X: np.linalg.norm(X, axis=1) < 0.75,
        (0.5, 0.0, 0.0),
        0,
        0.1,
        PRESSURE / MODULUS * 0.125 / 0.875 * (0.2 + 2.6),
    ),
    "torus": Part(torus, 0.25, _in_tube, (1.25, 0.0, 0.0), 0, 0.07),
    "elbow": Part(elbow, 0.3, lambda X: np.zeros(len(X), bool), (0.0, 0.0, 1.85), 1, 0.1),
}


@contextmanager
def modelled(part: Part, size: float) -> Iterator[None]:
    """Gmsh with the body, its inner and its plane faces as groups, and meshes of a `size` [m]."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        part.model(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        groups: dict[str, list[int]] = {}
        for _, tag in gmsh.model.getEntities(2):
            lower, upper = gmsh.model.getParametrizationBounds(2, tag)
            middle = gmsh.model.getValue(2, tag, list(0.5 * (lower + upper)))
            groups.setdefault(face(part, np.array([middle]))[0], []).append(tag)
        for name, tags in groups.items():
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        yield
    finally:
        gmsh.finalize()


def face(part: Part, X: Array) -> list[str]:
    """The names of the faces that places (m, 3) on the surface are on."""
    names = np.where(part.inside(X), "inner", "outer")
    for axis, name in enumerate(("start", "middle", "end")):
        if axis != 1 or part.model is not elbow:
            names = np.where(np.abs(X[:, axis]) < 1e-9, name, names)
    return names.tolist()


def by_elements(part: Part) -> Rest:
    """The equilibrium by quadratic tetrahedra."""
    with modelled(part, part.cells):
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.model.mesh.generate(3)
        tags, places, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(11)
    number = np.zeros(int(tags.max()) + 1, dtype=np.intp)
    number[tags.astype(np.intp)] = np.arange(len(tags))
    cells = number[corners.astype(np.intp).reshape(-1, 10)[:, _ORDER]]
    used, cells = np.unique(cells, return_inverse=True)
    X = places.reshape(-1, 3)[used]
    mesh = MeshTet2(np.ascontiguousarray(X.T), np.ascontiguousarray(cells.reshape(-1, 10).T))
    solid = Solid(mesh, ElementTetP2(), neo_hookean(MODULUS, RATIO))
    nodes = solid.nodes
    if part.model is elbow:
        held = np.repeat(np.abs(nodes[:, 2:]) < 1e-9, 3, axis=1)
        return solid.equilibrium(held, solid.weight(DENSITY * WEIGHT * np.array([0.0, -1.0, 0.0])))
    inner = mesh.facets_satisfying(
        lambda x: np.array(face(part, x.T)) == "inner", boundaries_only=True
    )
    basis = FacetBasis(mesh, solid.element, facets=inner)
    pushes = [LinearForm(lambda v, w, k=k: -PRESSURE * w.n[k] * v) for k in range(3)]
    loads = np.stack([push.assemble(basis) for push in pushes], axis=1)
    return solid.equilibrium(np.abs(nodes) < 1e-9, loads)


def by_particles(part: Part, across: int, point: Array) -> tuple[int, float]:
    """The number of particles, and the displacement at a point [m]."""
    spacing = part.thickness / across
    with TemporaryDirectory() as folder:
        path = Path(folder) / "part.msh"
        with modelled(part, spacing / _FINER):
            gmsh.model.mesh.generate(2)
            gmsh.write(str(path))
        shape = {"type": "mesh", "file": str(path), "repair": True}
        scene = Simulation.builder().body("part", shape=shape, spacing=spacing).statics()
        scene.material("neo-hookean", youngs_modulus=MODULUS, poissons_ratio=RATIO, density=DENSITY)
        simulation = loaded(part, scene).build()
    u = simulation.run().at([point]).displacement
    return simulation.particles.count, float(u[0, part.axis])


def loaded(part: Part, scene: SceneBuilder) -> Any:
    """The scene with what holds and loads the part."""
    if part.model is elbow:
        scene.boundary("clamp", where="end")
        return scene.effect("body-force", acceleration={"y": -WEIGHT})
    for axis in "xyz":
        scene.boundary("symmetry", axis=axis, at=0.0)
    return scene.boundary("pressure", where="inner", pressure=PRESSURE)


def rows(name: str, resolutions: list[int]) -> Iterator[tuple[str, ...]]:
    """Of one part, by particles across."""
    part = PARTS[name]
    rest = by_elements(part)
    nodes = rest.solid.nodes
    point = nodes[int(np.argmin(np.linalg.norm(nodes - np.array(part.point), axis=1)))]
    reference = float(rest.displacement(point)[part.axis])
    if part.exact is not None:
        off = 100.0 * (reference / part.exact - 1.0)
        yield name, "elements", f"{len(nodes)}", f"{reference:.6g}", f"{off:+.3f}", ""
        reference = part.exact
    else:
        yield name, "elements", f"{len(nodes)}", f"{reference:.6g}", "", ""
    before: tuple[int, float] | None = None
    for across in resolutions:
        count, u = by_particles(part, across, point)
        error = u / reference - 1.0
        order = ""
        if before is not None:
            order = f"{log(abs(before[1] / error)) / log(across / before[0]):.2f}"
        yield name, f"{across} across", f"{count}", f"{u:.6g}", f"{100.0 * error:+.3f}", order
        before = across, error


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("which", nargs="*", help=f"of {', '.join(PARTS)}; all by default")
    parser.add_argument("--across", type=int, nargs="+", default=[4, 6, 8])
    options = parser.parse_args()
    unknown = set(options.which) - set(PARTS)
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))}; take {', '.join(PARTS)}")
    lines = [
        line
        for name in PARTS
        if not options.which or name in options.which
        for line in rows(name, options.across)
    ]
    columns = ("part", "by", "places", "displacement, m", "error, %", "order")
    print(Table("Meshed parts beside quadratic finite elements", columns, tuple(lines)).text())


if __name__ == "__main__":
    main()
