"""Particles of bodies that public libraries made, against what these say of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from solidsph import Simulation
from solidsph.maths.arrays import Array
from solidsph_builtin.discretisations.fitted import Fitted
from solidsph_builtin.shapes.mesh import Mesh
from tests.helpers.mesh_bodies import BODIES, Body

QUICK = ("torus", "sphere")
ALL = [
    pytest.param(BODIES[name], id=name, marks=[] if name in QUICK else pytest.mark.validation)
    for name in BODIES
]


@pytest.mark.parametrize("body", ALL)
def test_particles_of_a_mesh(body: Body) -> None:
    """Moments are those that trimesh finds, but for the tensor's own rounding; the surface closes.

    The distances of nearest neighbours are those that `fitted` promises.
    """
    mesh, shape, h = body.make(), body.shape(), body.spacing
    made = Fitted().particles(shape, h)
    X, V = made.positions, made.volumes
    # The mesh of trimesh's own numbers, about its centre; its triangles are those of the shape.
    volume, centre = float(mesh.volume), np.asarray(mesh.center_mass)
    x = X - centre
    size = float(np.ptp(X, axis=0).max())
    assert V.sum() == pytest.approx(volume, rel=1e-10)
    assert np.abs(V @ x).max() < 1e-10 * volume * size
    second = (x.T * V) @ x
    inertia = np.trace(second) * np.eye(3) - second
    assert np.abs(inertia - mesh.moment_inertia).max() < 1e-10 * volume * size**2
    surface = made.tags["surface"]
    assert np.abs(shape.signed_distance(X[surface])).max() < 1e-6 * h
    assert np.abs(made.area_vectors.sum(axis=0)).max() < 1e-12 * h**2 * surface.sum()
    # Every place of the surface has a particle near it, and every particle a neighbour.
    samples = shape.surface(h).points
    assert cKDTree(X[surface]).query(samples)[0].max() < 1.0 * h
    nearest = cKDTree(X).query(X, k=2)[0][:, 1] / h
    # At the corner of a lattice it is 0.0375.
    assert V.min() > 0.02 * h**3
    assert nearest.min() > 0.8
    assert nearest.max() < 1.25


def linear(A: Array) -> dict[str, str]:
    """The field A X in formulas."""
    return {
        axis: "+".join(f"({a!r})*{x}" for a, x in zip(row, "XYZ", strict=True))
        for axis, row in zip("xyz", A.tolist(), strict=True)
    }


@pytest.mark.parametrize("body", ALL)
def test_a_uniform_stretch_is_reproduced(body: Body) -> None:
    """The linear patch test: the gradient of a linear field is exact at every particle."""
    A = 1e-3 * np.array([[1.0, 0.2, 0.0], [-0.3, -0.5, 0.1], [0.0, 0.2, 0.3]])
    scene = Simulation.builder().body("part", shape=body.shape(), spacing=body.spacing)
    scene.material("linear-elastic", youngs_modulus=1.0, poissons_ratio=0.3, density=1.0)
    scene.initial(displacement=linear(A))
    simulation = scene.duration(1.0).build()
    F = simulation.observe(simulation.start()).deformation_gradients
    assert np.abs(F - np.eye(3) - A).max() < 1e-8 * np.abs(A).max()


def in_triangles(mesh: trimesh.Trimesh, path: Path) -> Mesh:
    """The mesh, each triangle a face of its own: t0, t1, ..."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    for number, (a, b, c) in enumerate((mesh.faces + 1).tolist()):
        lines += [f"g t{number}", f"f {a} {b} {c}"]
    path.write_text("\n".join(lines))
    return Mesh(file=str(path))


@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(trimesh.creation.icosphere(1), id="sphere"),
        pytest.param(trimesh.creation.torus(1.0, 0.4, 12, 8), id="torus"),
    ],
)
def test_a_uniform_stress_balances_tractions(mesh: trimesh.Trimesh, tmp_path: Path) -> None:
    """The patch test of forces: under sigma n on the triangles the stress is sigma everywhere.

    Particles at one end are held where that stress moves them to. Newton's method leaves 1e-9 of
    the loads, and single particles resist less than the body does. Strains are some 1e-6, and so
    is what differs between forces per area before and after.
    """
    modulus, ratio = 1e6, 0.3
    sigma = np.array([[1.0, 0.4, -0.2], [0.4, -0.5, 0.3], [-0.2, 0.3, 0.6]])
    strain = ((1.0 + ratio) * sigma - ratio * np.trace(sigma) * np.eye(3)) / modulus
    shape = in_triangles(mesh, tmp_path / "body.obj")
    scene = Simulation.builder().body("part", shape=shape, spacing=0.15).duration(1.0).statics()
    scene.material("linear-elastic", youngs_modulus=modulus, poissons_ratio=ratio, density=1.0)
    scene.boundary("prescribed-motion", where="X > 0.8", displacement=linear(strain))
    for number, traction in enumerate((mesh.face_normals @ sigma).tolist()):
        scene.boundary(
            "traction", where=f"t{number}", traction=dict(zip("xyz", traction, strict=True))
        )
    simulation = scene.build()
    stresses = simulation.observe(simulation.run().state).stresses
    assert np.abs(stresses - sigma).max() < 1e-6
