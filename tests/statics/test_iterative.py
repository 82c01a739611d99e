"""Equilibria by iteration against those by a factorisation."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from solidsph import SceneError, Simulation
from solidsph.errors import BuildError, ConvergenceError
from solidsph.maths.arrays import Array
from solidsph.registry import registry
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium, tangent
from solidsph.statics.alternation import alternating_signs
from solidsph.statics.coarse_space import CoarseSpace, Fineness
from solidsph.statics.increment import AT_REST
from solidsph.statics.iterative import IterativeSolver
from solidsph.statics.solvers import linear_system
from tests.helpers.scenes import SOFT, box, touching

# The forces are in balance to 1e-9, and the softest motion of these bodies is some hundred times as
# soft as the stiffest that loads move.
CLOSE = 1e-6


def beam(d: int, across: int, **material: Any) -> SceneBuilder:
    """A cantilever three times as long as it is thick, of a scene's own defaults."""
    return (
        Simulation.builder()
        .body("beam", shape={"type": "box", "lengths": [3.0, *[1.0] * (d - 1)]}, spacing=1 / across)
        .material("neo-hookean", **{**SOFT, **material})
        .boundary("clamp", where="left")
        .duration(1.0)
    )


def moved(simulation: Simulation, solver: str) -> Array:
    found: Array = equilibrium(simulation, solver=solver).state.positions
    return found - simulation.particles.positions


def compared(scene: SceneBuilder) -> None:
    simulation = scene.build()
    direct, iterated = (moved(simulation, solver) for solver in ("direct", "iterative"))
    assert np.abs(direct).max() > 1e-4
    assert iterated == pytest.approx(direct, abs=CLOSE * np.abs(direct).max())


# --- The same equilibria -------------------------------------------------------------------------


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_a_bent_beam(d: int, nu: float) -> None:
    pulled = {"y": -3e3}
    compared(beam(d, 4, poissons_ratio=nu).boundary("traction", where="right", traction=pulled))


@settings(max_examples=10)
@given(
    d=st.sampled_from([2, 3]),
    spread=st.floats(0.0, 0.15),
    gradient=st.sampled_from(["corrected", "quadratic", "consistent"]),
    pull=st.floats(-2e4, 2e4).filter(lambda pull: abs(pull) > 1e3),
)
def test_a_block_of_disordered_particles(d: int, spread: float, gradient: str, pull: float) -> None:
    jittered = {"type": "jittered", "of": "lattice", "amplitude": spread, "seed": 1}
    compared(
        box(d, 5, discretisation=jittered if spread else "lattice")
        .formulation("total-lagrangian", gradient=gradient)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": pull, "y": 0.2 * pull})
    )


def test_a_load_that_follows_its_surface() -> None:
    compared(beam(2, 5).boundary("pressure", where="top", pressure=4e3))


def test_a_plane_of_symmetry_and_an_imposed_motion() -> None:
    compared(
        beam(3, 4)
        .boundary("symmetry", axis="z")
        .boundary("prescribed-motion", where="right", displacement={"y": "0.3 * t"})
    )


def test_particles_alone_in_a_cell_of_the_grid() -> None:
    """Five corners of this torus stand alone in a cell, and turn there without stiffness."""
    torus = trimesh.creation.torus(1.0, 0.4, major_sections=12, minor_sections=8)
    mesh = {"type": "mesh", "vertices": torus.vertices, "triangles": torus.faces}
    compared(
        Simulation.builder()
        .body("torus", shape=mesh, spacing=0.15)
        .material("neo-hookean", **SOFT)
        .formulation("total-lagrangian", gradient="corrected")
        .boundary("clamp", where="X > 0.8")
        .boundary("traction", where="surface and X < -1", traction={"x": -3e3})
        .duration(1.0)
    )


def test_two_bodies_with_a_joint() -> None:
    compared(
        touching(2, 5)
        .effect("joint", between=["block", "other"], reach=1.8)
        .boundary("clamp", where="X < 0.2")
        .effect("body-force", acceleration={"y": -5.0})
    )


@pytest.mark.parametrize("gradient", registry.names("gradients"))
@pytest.mark.parametrize("engine", ["matrix", "compiled"])
def test_a_product_is_that_of_the_assembled_tangent(gradient: str, engine: str) -> None:
    simulation = (
        box(2, 5)
        .formulation("total-lagrangian", gradient=gradient, divergence="variational")
        .boundary("clamp", where="left")
        .engine(engine)
        .build()
    )
    system = linear_system(simulation, "iterative")
    random = np.random.default_rng(0)
    u, motion = 0.01 * random.uniform(-1.0, 1.0, (2, *simulation.particles.positions.shape))
    product = system.tangent.product(system.tangent.moduli(u), motion)
    wanted = (tangent(simulation, u) @ motion.ravel()).reshape(product.shape)
    # The rounding of sums in another order.
    assert product == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
    n, d = u.shape
    blocks = system.tangent.own_stiffness(system.tangent.moduli(u).alone)
    exact = tangent(simulation, u).toarray().reshape(n, d, n, d)[range(n), :, range(n)]
    assert blocks == pytest.approx(exact, abs=1e-12 * np.abs(exact).max())


# --- How fast ------------------------------------------------------------------------------------


def products(d: int, across: int, *, grids: bool = True) -> int:
    """Products with the tangent until random forces are in balance to a thousandth."""
    simulation = beam(d, across).build()
    system = linear_system(simulation, "iterative")
    assert isinstance(system.solver, IterativeSolver)
    if not grids:
        system.solver.smooth_space = system.solver.alternating_space = None
    before = system.solver.products
    u = np.zeros_like(simulation.particles.positions)
    forces = np.random.default_rng(0).standard_normal(system.freedoms.count)
    system.solver.linearised(u, None, AT_REST).solve(forces, 1e-3)
    return system.solver.products - before


@pytest.mark.parametrize(("d", "across"), [(2, 6), (3, 3)])
def test_a_finer_body_takes_hardly_more_iterations(d: int, across: int) -> None:
    """Without the coarse grids they grow in proportion to the particles across."""
    fine = (4 if d == 2 else 2) * across
    assert products(d, fine) < 1.8 * products(d, across)
    assert products(d, fine, grids=False) > 3.0 * products(d, fine)


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("load", [4e3, 1e4])
def test_rubber_takes_hardly_more_newton_steps(load: float, solver: str) -> None:
    """With the volume that a step reaches, in place of the predicted one, it takes 9."""

    def steps(nu: float) -> int:
        scene = beam(3, 4, poissons_ratio=nu)
        scene = scene.boundary("traction", where="right", traction={"y": -load})
        return equilibrium(scene.build(), solver=solver).iterations

    assert steps(0.49) <= steps(0.3) + 1


# --- What it is made of --------------------------------------------------------------------------


@pytest.mark.parametrize("d", [1, 2, 3])
def test_signs_alternate_along_the_rows_of_a_lattice(d: int) -> None:
    rows = np.stack(np.meshgrid(*[np.arange(5)] * d, indexing="ij"), axis=-1).reshape(-1, d)
    # A box is filled by rows that are not quite a spacing apart.
    patterns = alternating_signs(0.103 * rows + 7.0, 0.1)
    found = {tuple(signs) for signs in patterns}
    chosen = [c for c in product((0, 1), repeat=d) if any(c)]
    assert found == {tuple((-1.0) ** (rows @ np.array(c))) for c in chosen}
    disordered = np.random.default_rng(0).uniform(0.0, 1.0, (50, d))
    assert not any(signs.any() for signs in alternating_signs(disordered, 0.1))


@pytest.mark.parametrize("d", [2, 3])
def test_the_coarse_stiffness_of_a_uniform_strain_is_exact(d: int) -> None:
    simulation = box(d, 7).build()
    particles = simulation.particles
    internal = simulation.dynamics.internal
    free = np.ones_like(particles.positions, dtype=bool)
    signs = np.ones(particles.count)
    space = CoarseSpace.of(
        simulation.model.bodies, free, signs[None], internal.gradients, Fineness(2.5, {d: 1_000})
    )
    random = np.random.default_rng(0)
    A = random.uniform(-1.0, 1.0, (d * d, d * d))
    moduli = particles.volumes[:, None, None] * (A + A.T)
    H = random.uniform(-1.0, 1.0, (d, d))
    # The values at nodes that make this field, by least squares.
    field = (particles.positions @ H.T).ravel()
    P = space.matrix(0).toarray()
    values = np.linalg.lstsq(P, field, rcond=None)[0]
    assert P @ values == pytest.approx(field, abs=1e-10)
    energy = values @ (space.stiffness(0, moduli) @ values)
    exact = particles.volumes.sum() * H.ravel() @ (A + A.T) @ H.ravel()
    assert energy == pytest.approx(exact, rel=1e-9)


# --- Stability -----------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize(("load", "stable"), [(0.5, True), (2.0, False)])
def test_it_tells_whether_a_strip_would_buckle(solver: str, load: float, stable: bool) -> None:
    """A column of length L clamped at one end buckles at pi^2 E' I / (4 L^2) (Euler)."""
    across, slender = 6, 10.0
    modulus = 1e6 / (1.0 - 0.3**2)
    euler = np.pi**2 * modulus / 12.0 / (4.0 * slender**2)
    simulation = (
        Simulation.builder()
        .body("strip", shape={"type": "box", "lengths": [slender, 1.0]}, spacing=1.0 / across)
        .material("neo-hookean", **SOFT)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"x": -load * euler})
        .duration(1.0)
        .build()
    )
    assert equilibrium(simulation, solver=solver).stable is stable


# --- Failures ------------------------------------------------------------------------------------


def test_a_body_that_nothing_holds_says_so() -> None:
    simulation = box(3, 5).effect("body-force", acceleration={"x": 1.0}).build()
    with pytest.raises(ConvergenceError, match="clamp it in every direction"):
        equilibrium(simulation, solver="iterative")


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (
            box(2, discretisation={"type": "lattice", "ghosts": 3}).boundary("ghost-extension"),
            "ghosts follow the particles",
        ),
        (box(2).formulation("total-lagrangian", divergence="plain"), "the forces have no energy"),
        (box(2).boundary("clamp", where="all"), "nothing is free to move"),
    ],
)
def test_what_hinders_it_is_told(scene: SceneBuilder, reason: str) -> None:
    simulation = scene.build()
    with pytest.raises(SceneError, match=reason):
        equilibrium(simulation, solver="iterative")
    equilibrium(simulation)


def test_an_unknown_solver_is_refused() -> None:
    known = "solver must be one of 'automatic', 'direct', 'iterative'"
    with pytest.raises(BuildError, match=known):
        box(2).statics(solver="magic").build()
    with pytest.raises(SceneError, match="solver must be one of"):
        equilibrium(box(2).build(), solver="magic")
