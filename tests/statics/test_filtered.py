"""Equilibria of bodies that filter their dilatation: tangents, solvers, modes, stress across."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from solidsph import Simulation
from solidsph.maths.arrays import Array
from solidsph.probes.out_of_plane import whole_stress
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium, frequencies, tangent
from solidsph.statics.solvers import linear_system
from solidsph.studies.spectrum import spectrum
from tests.helpers.scenes import SOFT
from tests.statics.test_iterative import compared

NEAR = {**SOFT, "poissons_ratio": 0.49}
NEO_HOOKEAN = {"type": "neo-hookean", **NEAR}
LINEAR = {"type": "linear-elastic", **NEAR}


def block(d: int, across: int = 4, material: dict[str, Any] | None = None) -> SceneBuilder:
    """A block of a scene's own defaults, twice as long as it is thick, held on the left."""
    return (
        Simulation.builder()
        .body(
            "block", shape={"type": "box", "lengths": [2.0, *[1.0] * (d - 1)]}, spacing=1 / across
        )
        .material(material or NEO_HOOKEAN)
        .boundary("clamp", where="left")
        .duration(1.0)
    )


def shaken(simulation: Simulation) -> Array:
    spacing = simulation.particles.spacings.min()
    random = np.random.default_rng(0)
    return 0.02 * spacing * random.normal(size=simulation.particles.positions.shape)


def asymmetry(matrix: Any) -> float:
    return float(abs(matrix - matrix.T).max() / abs(matrix).max())


@pytest.mark.parametrize("material", [NEO_HOOKEAN, LINEAR], ids=lambda one: one["type"])
@pytest.mark.parametrize("d", [2, 3])
def test_tangent_is_minus_the_derivative_of_the_forces(d: int, material: dict[str, Any]) -> None:
    simulation = block(d, material=material).engine("matrix").build()
    assert simulation.model.filters
    u = shaken(simulation)
    K, forces = tangent(simulation, u), simulation.dynamics.internal.forces
    way = np.random.default_rng(1).normal(size=u.shape)
    h = 1e-6 * simulation.particles.spacings.min()
    slope = (forces(0.0, u + h * way) - forces(0.0, u - h * way)) / (2 * h)
    # The quotient is rounded to 1e-16 / 1e-6 of the forces' size in stiffnesses and strains.
    assert np.abs((K @ way.ravel()).reshape(u.shape) + slope).max() <= 1e-7 * np.abs(slope).max()
    assert asymmetry(K) <= 1e-13


@pytest.mark.parametrize("engine", ["matrix", "compiled"])
def test_a_product_is_that_of_the_assembled_tangent(engine: str) -> None:
    simulation = block(2).engine(engine).build()
    u = shaken(simulation)
    system = linear_system(simulation, "iterative")
    motion = np.random.default_rng(1).normal(size=u.shape)
    product = system.tangent.product(system.tangent.moduli(u), motion)
    wanted = (tangent(simulation, u) @ motion.ravel()).reshape(product.shape)
    assert product == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("nu", [0.49, 0.4999])
def test_both_solvers_find_the_same_equilibrium(d: int, nu: float) -> None:
    compared(
        block(d, material={**NEO_HOOKEAN, "poissons_ratio": nu}).boundary(
            "traction", where="right", traction={"y": "-2e3"}
        )
    )


def test_newton_converges_quadratically() -> None:
    scene = block(2).boundary("traction", where="right", traction={"y": "-1e4"})
    result = equilibrium(scene.build(), tolerance=1e-11, solver="direct")
    logs = np.log10(result.steps[-1].residuals)
    # As of a body that does not filter (tests/statics/test_statics.py).
    orders = [b / a for a, b in pairwise(logs) if -5.5 < a < -1.0]
    assert orders
    assert min(orders) > 1.6


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_frequencies_are_those_of_the_dense_spectrum(solver: str) -> None:
    simulation = block(2).build()
    state = simulation.start()
    dense = np.sort(spectrum(simulation.dynamics, state).frequencies)
    found = frequencies(simulation, 4, state, solver=solver).angular_frequencies
    # The dense matrix is numerical; its rounding weighs most on the lowest.
    assert found == pytest.approx(dense[:4], rel=1e-5)


def test_a_flowing_metal_like_body_is_in_equilibrium() -> None:
    flowing = {"type": "j2-plasticity", **NEAR, "yield_stress": 2e4, "hardening": 1e5}
    scene = block(2, material=flowing).boundary("traction", where="right", traction={"y": "-3e3"})
    result = equilibrium(scene.build(), load_steps=4, solver="direct")
    assert result.state.memory["history of block"][:, 0].max() > 1e-3
    assert max(len(step.residuals) for step in result.steps) <= 8
    compared(scene.statics(load_steps=4))


def test_stress_across_a_plane_is_that_of_plane_strain() -> None:
    """nu times the sum of those in the plane, up to (1 - 2 nu) of what the filter adds to all."""
    nu = 0.4999
    simulation = block(2, material={**LINEAR, "poissons_ratio": nu}).engine("matrix").build()
    (body,) = simulation.model.bodies
    fields = simulation.dynamics.internal.fields(shaken(simulation))
    F = fields.deformation_gradients
    rows = np.arange(len(F))
    # Of the linear law: P is the Cauchy stress, which `whole_stress` takes to positions x.
    wide = np.broadcast_to(np.eye(3), (len(F), 3, 3)).copy()
    wide[:, :2, :2] = F
    cauchy = whole_stress(body, F, rows, {})
    P = np.linalg.det(F)[:, None, None] * cauchy @ np.linalg.inv(wide).transpose(0, 2, 1)
    assert P[:, :2, :2] == pytest.approx(fields.stresses, abs=1e-9 * np.abs(P).max())
    in_plane = P[:, 0, 0] + P[:, 1, 1]
    assert P[:, 2, 2] == pytest.approx(nu * in_plane, abs=(1 - 2 * nu) * np.abs(P).max())
