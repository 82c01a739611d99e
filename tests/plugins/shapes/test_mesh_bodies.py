"""Particles of bodies that public libraries made, against what these say of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from solidsph import Simulation
from solidsph_builtin.discretisations.fitted import Fitted
from tests.helpers.mesh_bodies import BODIES, Body

QUICK = ("torus", "sphere")
ALL = [
    pytest.param(BODIES[name], id=name, marks=[] if name in QUICK else pytest.mark.validation)
    for name in BODIES
]


@pytest.mark.parametrize("body", ALL)
def test_particles_of_a_mesh(body: Body) -> None:
    """Moments are those that trimesh finds, but for the tensor's own rounding; the surface closes.

    Nearest neighbours are 0.5 spacings apart at least: `fitted` promises no more. Less than 0.8 are
    some per cent, and a sixth in a body as thin as this torus.
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
    assert nearest.min() > 0.49
    assert nearest.max() < 1.25
    assert np.mean(nearest < 0.8) < 0.2


@pytest.mark.parametrize("body", ALL)
def test_a_uniform_stretch_is_reproduced(body: Body) -> None:
    """The linear patch test: the gradient of a linear field is exact at every particle."""
    A = 1e-3 * np.array([[1.0, 0.2, 0.0], [-0.3, -0.5, 0.1], [0.0, 0.2, 0.3]])
    scene = Simulation.builder().body("part", shape=body.shape(), spacing=body.spacing)
    scene.material("linear-elastic", youngs_modulus=1.0, poissons_ratio=0.3, density=1.0)
    scene.initial(
        displacement={
            axis: "+".join(f"({a!r})*{x}" for a, x in zip(row, "XYZ", strict=True))
            for axis, row in zip("xyz", A.tolist(), strict=True)
        }
    )
    simulation = scene.duration(1.0).build()
    F = simulation.observe(simulation.start()).deformation_gradients
    assert np.abs(F - np.eye(3) - A).max() < 1e-8 * np.abs(A).max()
