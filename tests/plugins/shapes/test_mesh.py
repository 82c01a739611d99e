"""Meshes: what files say, against closed forms and the libraries that wrote them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshlane
import numpy as np
import pytest
import trimesh

from solidsph import Scene, Simulation, resume
from solidsph.errors import SceneError, SolidsphError
from solidsph.maths.arrays import Array
from solidsph.testing import conformance
from solidsph_builtin.discretisations.fitted import Fitted
from solidsph_builtin.shapes.mesh import Mesh
from tests.helpers.mesh_bodies import BODIES, bracket, exported, hollow_box, modelled
from tests.helpers.resuming import Stop

BOX = np.array([1.2, 0.9, 0.5])


def of(mesh: trimesh.Trimesh, **parameters: object) -> Mesh:
    return Mesh(vertices=mesh.vertices, triangles=mesh.faces, **parameters)  # type: ignore[arg-type]


def box() -> trimesh.Trimesh:
    """A box in one corner of the axes."""
    return trimesh.creation.box(bounds=[np.zeros(3), BOX])


def areas_of(shape: Mesh, spacing: float = 0.1) -> dict[str, float]:
    surface = shape.surface(spacing)
    names = np.array(surface.faces)
    sizes = np.linalg.norm(surface.area_vectors, axis=1)
    return {name: float(sizes[names == name].sum()) for name in sorted(set(surface.faces))}


@pytest.mark.parametrize(
    "name",
    ["torus", *(pytest.param(n, marks=pytest.mark.validation) for n in ("hollow box", "blob"))],
)
def test_what_every_shape_promises(name: str) -> None:
    assert [one for one in conformance("shapes", BODIES[name].shape()) if not one.passed] == []


def test_distances_moments_and_faces_of_a_box() -> None:
    shape = of(box())
    points = np.random.default_rng(0).uniform(-0.5, 1.7, size=(500, 3))
    outside = np.maximum(np.maximum(-points, points - BOX), 0.0)
    inside = np.minimum(np.maximum(-points, points - BOX).max(axis=1), 0.0)
    expected = np.linalg.norm(outside, axis=1) + inside
    assert shape.signed_distance(points) == pytest.approx(expected, abs=1e-15)
    assert shape.convex
    assert shape.volume() == pytest.approx(BOX.prod(), rel=1e-14)
    about = np.array([0.3, -2.0, 0.1])
    low, high = -about, BOX - about
    found = shape.moments(about)
    first = BOX.prod() * 0.5 * (low + high)
    assert found.first == pytest.approx(first, rel=1e-13)
    second = np.outer(first, first) / BOX.prod() + np.diag(BOX.prod() * BOX**2 / 12.0)
    assert found.second == pytest.approx(second, rel=1e-13)
    sizes = [BOX[1] * BOX[2], BOX[0] * BOX[2], BOX[0] * BOX[1]]
    assert sorted(areas_of(shape).values()) == pytest.approx(sorted(2 * sizes), rel=1e-13)


def test_the_side_of_every_point_is_that_of_rays() -> None:
    """Of a body with edges and corners that point inwards, where normals of triangles mislead."""
    mesh = BODIES["bracket"].make()
    lower, upper = mesh.bounds
    points = np.random.default_rng(1).uniform(lower - 0.1, upper + 0.1, size=(400, 3))
    crossed = [crossings(mesh, points, axis) for axis in np.eye(3) + 0.01]
    inside = np.median(np.array(crossed) % 2, axis=0) == 1
    assert np.array_equal(of(mesh).signed_distance(points) < 0.0, inside)


def crossings(mesh: trimesh.Trimesh, points: Array, direction: Array) -> Array:
    """How many triangles a ray from each point goes through (Moeller & Trumbore 1997)."""
    a, b, c = np.asarray(mesh.triangles).transpose(1, 0, 2)
    across = np.cross(direction, c - a)
    determinants = np.einsum("ki,ki->k", b - a, across)
    counts = np.zeros(len(points), dtype=np.intp)
    with np.errstate(divide="ignore", invalid="ignore"):
        for row, point in enumerate(points):
            u = np.einsum("ki,ki->k", point - a, across) / determinants
            other = np.cross(point - a, b - a)
            v = other @ direction / determinants
            t = np.einsum("ki,ki->k", c - a, other) / determinants
            counts[row] = np.sum((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0))
    return counts


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj"])
def test_files_of_triangles(tmp_path: Path, suffix: str) -> None:
    path = exported(hollow_box(), tmp_path / f"walls{suffix}")
    shape = Mesh(path)
    # Single precision in STL and PLY.
    assert shape.volume() == pytest.approx(0.48 - 0.192, rel=1e-6)
    assert len(areas_of(shape)) == 12


def test_unit_scale_turn_and_place(tmp_path: Path) -> None:
    path = exported(box(), tmp_path / "box.stl")
    shape = Mesh(path, unit="mm", scale=2.0, rotate=[90.0, 0.0, 90.0], translate=[1.0, 2.0, 3.0])
    # About x: (x, -z, y); then about z: (z, x, y).
    size = 2e-3 * BOX[[2, 0, 1]]
    lower, upper = shape.bounds()
    assert lower == pytest.approx([1.0, 2.0, 3.0], abs=1e-9)
    assert upper - lower == pytest.approx(size, rel=1e-6)


@pytest.mark.parametrize(("unit", "spacing"), [("m", 1e-3), ("nm", 0.1)])
def test_a_wrong_unit_is_told(tmp_path: Path, unit: str, spacing: float) -> None:
    """A box of millimetres read as metres, and one of metres as nanometres."""
    shape = Mesh(exported(box(), tmp_path / "box.stl"), unit=unit)
    with pytest.raises(SceneError, match="check the unit of the shape"):
        Fitted().particles(shape, spacing)


def test_edges_part_faces_by_their_angle() -> None:
    prism = trimesh.creation.cylinder(1.0, 1.0, sections=8)  # its sides meet at 45 degrees
    assert len(areas_of(of(prism))) == 10
    assert len(areas_of(of(prism, edge_angle=50.0))) == 3
    assert list(areas_of(of(prism, edge_angle=100.0))) == ["face-1"]


def test_many_small_faces_are_one() -> None:
    rough = trimesh.creation.icosphere(3)
    noise = np.random.default_rng(0).normal(scale=0.03, size=rough.vertices.shape)
    shape = of(trimesh.Trimesh(rough.vertices + noise, rough.faces, process=False), edge_angle=1.0)
    assert len(areas_of(shape)) == 200


def test_groups_of_text_files(tmp_path: Path) -> None:
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in triangle)
        + "endloop\nendfacet\n"
        for triangle in box().triangles
    ]
    stl = tmp_path / "two.stl"
    stl.write_text(
        f"solid the lid\n{''.join(facets[:4])}endsolid\nsolid rest\n{''.join(facets[4:])}endsolid\n"
    )
    assert list(areas_of(Mesh(stl))) == ["rest", "the-lid"]
    lines = [f"v {x} {y} {z}" for x, y, z in box().vertices]
    lines += ["mtllib elsewhere.mtl", "g low"]
    faces = [f"f {a} {b} {c}" for a, b, c in box().faces + 1]
    obj = tmp_path / "two.obj"
    obj.write_text("\n".join([*lines, *faces[:4], "g 2nd part", *faces[4:]]))
    assert list(areas_of(Mesh(obj))) == ["face-2nd-part", "low"]


@pytest.mark.parametrize(
    ("suffix", "order"), [(".msh", 1), (".msh", 2), (".vtu", 1), (".vtu", 2), (".inp", 1)]
)
def test_solid_cells_of_gmsh_with_their_groups(tmp_path: Path, suffix: str, order: int) -> None:
    """A cylinder whose base and side are groups; the other end is found by its edge."""
    path = tmp_path / f"cylinder{suffix}"

    def build(occ: object) -> None:
        occ.addCylinder(0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 1.0)  # type: ignore[attr-defined]

    with modelled(build, around=16) as gmsh:
        places = {}
        for _, tag in gmsh.model.getEntities(2):
            places[round(gmsh.model.occ.getCenterOfMass(2, tag)[2], 6)] = tag
        gmsh.model.addPhysicalGroup(2, [places[0.0]], name="base")
        gmsh.model.addPhysicalGroup(2, [places[1.0]], name="side")
        gmsh.model.addPhysicalGroup(3, [1], name="body")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        written = path if suffix != ".vtu" else path.with_suffix(".msh")
        gmsh.write(str(written))
    if suffix == ".vtu":
        mesh = meshlane.read(written)
        mesh.cell_sets.clear()
        mesh.write(path)
    shape = Mesh(path)
    # Sides of a polygon with 16 corners or more, of 32 where nodes are in the middle of edges.
    assert shape.volume() == pytest.approx(2.0 * np.pi, rel=0.03 / order**2)
    faces = areas_of(shape)
    names = (
        {"base", "side", "face-1"} if suffix != ".vtu" else {"physical-1", "physical-2", "face-1"}
    )
    assert set(faces) == names
    assert faces["face-1"] == pytest.approx(np.pi, rel=0.03)


def test_cells_with_four_corners(tmp_path: Path) -> None:
    points = np.stack(np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0], indexing="ij"), axis=-1)
    cell = np.array([0, 4, 6, 2, 1, 5, 7, 3])
    mesh = meshlane.Mesh(
        points.reshape(-1, 3),
        [("hexahedron", np.array([cell, cell + 4]))],
        point_sets={"HELD": np.arange(4)},
    )
    mesh.write(tmp_path / "two.inp")
    shape = Mesh(tmp_path / "two.inp")
    assert shape.volume() == pytest.approx(2.0, rel=1e-14)
    assert areas_of(shape)["HELD"] == pytest.approx(1.0, rel=1e-14)
    assert len(areas_of(shape)) == 6


# Two cells of a kind in a part, placed by an instance, as a preprocessor writes it.
DECK = """*Heading
*Part, name=PART-1
*Node
{nodes}
*Element, type={kind}
{elements}
*End Part
*Assembly, name=Assembly
*Instance, name=PART-1-1, part=PART-1
*End Instance
*Elset, elset=_Top_S2, internal, instance=PART-1-1
 1, 2
*Elset, elset=_End_S4, internal, instance=PART-1-1
 2,
*Surface, type=ELEMENT, name=Top
** all of it
_Top_S2, S2
*Surface, type=ELEMENT, name="End"
_END_S4, S4
*End Assembly
"""


@pytest.mark.parametrize("kind", ["C3D8R", "C3D20"])
def test_surfaces_by_faces_of_elements(kind: str, tmp_path: Path) -> None:
    """The second face of a brick has its last corners, the fourth the second and the third."""
    corners = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    )
    edges = [*((i, (i + 1) % 4) for i in range(4)), *((4 + i, 4 + (i + 1) % 4) for i in range(4))]
    edges += [(i, i + 4) for i in range(4)]
    brick = np.vstack([corners, [0.5 * (corners[a] + corners[b]) for a, b in edges]])
    brick = brick[: int(kind[3:5].rstrip("R"))]
    both = np.concatenate([brick, brick + np.array([1.0, 0.0, 0.0])])
    nodes, numbers = np.unique(both, axis=0, return_inverse=True)
    numbers = numbers.reshape(2, -1) + 1
    deck = DECK.format(
        kind=kind,
        nodes="\n".join(f"{n + 1}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(nodes.tolist())),
        elements="\n".join(
            ",\n".join(", ".join(map(str, line)) for line in (row[:12], row[12:]) if line)
            for row in np.column_stack([[1, 2], numbers]).tolist()
        ),
    )
    (tmp_path / "two.inp").write_text(deck)
    shape = Mesh(tmp_path / "two.inp")
    assert shape.volume() == pytest.approx(2.0, rel=1e-14)
    surface = shape.surface(0.1)
    names = np.array(surface.faces)
    for name, wanted in (("Top", [0.0, 0.0, 2.0]), ("End", [1.0, 0.0, 0.0])):
        area = surface.area_vectors[names == name].sum(axis=0)
        assert area == pytest.approx(np.array(wanted), abs=1e-14)


def written(path: Path, *, recombined: bool, incomplete: bool) -> Path:
    """A cylinder of bricks of 20 or 27 points, or of wedges of 15 or 18."""

    def build(occ: Any) -> None:
        disc = occ.addDisk(0.0, 0.0, 0.0, 1.0, 1.0)
        occ.extrude([(2, disc)], 0.0, 0.0, 2.0, numElements=[3], recombine=True)

    with modelled(build) as gmsh:
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
        gmsh.option.setNumber("Mesh.RecombineAll", recombined)
        (base,) = [
            tag
            for _, tag in gmsh.model.getEntities(2)
            if gmsh.model.occ.getCenterOfMass(2, tag)[2] == pytest.approx(0.0)
        ]
        gmsh.model.addPhysicalGroup(2, [base], name="base")
        gmsh.model.addPhysicalGroup(3, [1], name="body")
        gmsh.model.mesh.clear()
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))
    return path


@pytest.mark.parametrize(
    ("name", "recombined", "incomplete"),
    [
        ("a.msh", True, True),
        ("a.msh", True, False),
        ("a.msh", False, True),
        ("a.inp", True, True),
        ("a.inp", False, True),
    ],
)
def test_cells_of_the_second_degree(
    name: str, recombined: bool, incomplete: bool, tmp_path: Path
) -> None:
    shape = Mesh(written(tmp_path / name, recombined=recombined, incomplete=incomplete))
    # Sides of a polygon with 32 corners or more.
    assert shape.volume() == pytest.approx(2.0 * np.pi, rel=0.01)
    assert areas_of(shape)["base"] == pytest.approx(np.pi, rel=0.01)


@pytest.mark.parametrize(
    ("name", "recombined", "message"),
    [
        ("a.inp", True, "solid elements of the type C3D27 are not read; use others, such as C3D4"),
        ("a.msh", False, "cells of the kind 'wedge18' are not read; use triangle, quad, tetra"),
    ],
)
def test_cells_that_are_not_read(name: str, recombined: bool, message: str, tmp_path: Path) -> None:
    """They are not left out: the body would have another surface."""
    path = written(tmp_path / name, recombined=recombined, incomplete=False)
    with pytest.raises(SceneError, match=message):
        Mesh(path)


def test_step(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """In the millimetres that STEP files are in, read as metres."""
    path = tmp_path / "bracket.step"
    with modelled(bracket) as gmsh:
        volume = gmsh.model.occ.getMass(3, gmsh.model.getEntities(3)[0][1])
        gmsh.write(str(path))
    capfd.readouterr()
    shape = Mesh(path)
    assert capfd.readouterr() == ("", "")
    assert shape.volume() == pytest.approx(1e-9 * volume, rel=2e-3)
    assert set(areas_of(shape, 1e-4)) == {f"surface-{n}" for n in range(1, 12)}
    with pytest.raises(SceneError, match="it holds its own unit; leave out unit = 'mm'"):
        Mesh(path, unit="mm")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "give either a file, or vertices and triangles, got nothing"),
        ({"file": "a.stl", "vertices": [[0, 0, 0]]}, "got file and vertices"),
        ({"file": "a.stl", "unit": "inch"}, "unit must be one of m, dm, cm, mm"),
        ({"file": "a.stl", "scale": 0.0}, "scale must be a positive finite number, got 0.0"),
        ({"file": "a.stl", "rotate": [90.0]}, "rotate must be 3 angles in degrees"),
        ({"file": "a.stl", "translate": [1.0, 2.0]}, "translate must be 3 coordinates in m"),
        ({"file": "a.stl", "edge_angle": 0.0}, "edge_angle must be an angle above 0"),
        ({"file": 5}, "file must be the path of a file, got 5"),
        ({"vertices": [[0, 0]], "triangles": [[0, 0, 0]]}, "vertices must be rows of 3"),
        (
            {"vertices": [[0, 0, 0]], "triangles": [[0, 0, 1]]},
            "numbers of vertices from 0 to 0, got 0 to 1",
        ),
        ({"vertices": [[0, 0, 0]], "triangles": [[0.5, 0, 0]]}, "rows of 3 whole numbers"),
        ({"vertices": [["a", 0, 0]], "triangles": [[0, 0, 0]]}, "could not convert"),
    ],
)
def test_parameters_that_are_refused(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Mesh(**parameters)  # type: ignore[arg-type]


# Runs --------------------------------------------------------------------------------------------

SCENE = """
duration = 0.05
outputs = 4
[body.block]
spacing = 0.15
shape = {type = "mesh", file = "block.stl"}
[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[[boundary]]
type = "clamp"
where = "face-1"
[[initial]]
velocity = {x = "0.1*sin(2*X)"}
"""


def moved(path: Path) -> None:
    exported(box().apply_translation([1e-3, 0.0, 0.0]), path)


@pytest.mark.parametrize(
    ("change", "difference", "forced"),
    [
        (moved, "positions differ", "positions differ"),
        (lambda path: path.write_bytes(b"!" + path.read_bytes()[1:]), "'block.stl' .* changed", ""),
        (Path.unlink, "No such file", "No such file"),
    ],
)
def test_a_run_does_not_go_on_with_another_file(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: Callable[[Path], None],
    difference: str,
    forced: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    path = exported(box(), tmp_path / "block.stl")
    with pytest.raises(KeyboardInterrupt):
        Simulation.builder(Scene.from_toml(SCENE)).build().run(record="run.h5", observers=[Stop(3)])
    change(path)
    for message, force in ((difference, False), (forced, True)):
        if not message:
            resume("run.h5", force=force)
            continue
        with pytest.raises(SolidsphError, match=message):
            resume("run.h5", force=force)


@pytest.mark.parametrize("word", ["surface", "interior", "all", "ghosts", "X", "t", "pi", "not"])
def test_a_group_named_as_a_word_of_conditions(word: str, tmp_path: Path) -> None:
    """Conditions keep the meaning of such words, and the group is found under a longer name."""
    box = trimesh.creation.box([1.0, 1.0, 1.0])
    lines = ["v {} {} {}".format(*vertex) for vertex in box.vertices]
    for number, corners in enumerate(box.faces + 1):
        lines += [f"g {word if number < 2 else 'rest'}", "f {} {} {}".format(*corners)]
    path = tmp_path / "box.obj"
    path.write_text("\n".join(lines))
    assert set(Mesh(file=str(path)).surface(0.2).faces) == {f"face-{word}", "rest"}
