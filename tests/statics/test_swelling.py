"""Equilibria of bodies that swell by heat."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from solidsph import Simulation
from solidsph.interfaces.memory import NOTHING
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium
from solidsph.statics.stiff import is_stiff_in_steps
from solidsph_builtin.materials.neo_hookean import NeoHookean
from tests.helpers.scenes import SOFT

EXPANSION = 1e-3  # strains of 0.1 at 100 K


def hot(temperature: str, d: int = 2, material: str = "neo-hookean") -> SceneBuilder:
    """A box, so short a time that no heat is conducted."""
    return (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [1.0] * d}, spacing=0.2)
        .material(material, **SOFT)
        .effect(
            "heat",
            conductivity=50.0,
            heat_capacity=500.0,
            expansion=EXPANSION,
            initial=temperature,
            largest=400.0,
        )
        .duration(1e-6)
        .statics()
    )


@pytest.mark.parametrize("d", [2, 3])
def test_stiffness_of_swelling_is_minus_the_derivative(d: int) -> None:
    scene = hot("100*X", d).build()
    (load,) = scene.dynamics.loads
    random, X = np.random.default_rng(0), scene.particles.positions
    u, du = 0.02 * random.standard_normal((2, *X.shape))
    still, h = np.zeros_like(u), 1e-6
    told: object = load
    assert is_stiff_in_steps(told)
    K = told.stiffness_of_step(0.0, 0.0, u, still, NOTHING)
    assert K is not None
    change = load.forces(0.0, X + u + h * du, still) - load.forces(0.0, X + u - h * du, still)
    measured = -change / (2.0 * h)
    wrong = (K @ du.ravel()).reshape(du.shape) - measured
    assert np.linalg.norm(wrong) < 1e-7 * np.linalg.norm(measured)  # rounding of the difference


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_a_free_hot_block_is_larger_and_without_stress(solver: str) -> None:
    """By more than 1 + expansion T, since it cannot swell out of the plane."""
    rollers = hot("100")
    for axis, face in {"x": "left", "y": "bottom"}.items():
        rollers = rollers.boundary("prescribed-motion", where=face, displacement={axis: "0"})
    scene = rollers.build()
    result = equilibrium(scene, solver=solver)
    assert result.iterations <= 8
    X, x = scene.particles.positions, result.state.positions
    stretch = _free_stretch(1.0 + 100.0 * EXPANSION)
    # The rows that are held are half a spacing inside the surface. 1e-9 of the forces are left.
    np.testing.assert_allclose(x - X.min(), stretch * (X - X.min()), atol=1e-8)


def _free_stretch(g: float) -> float:
    """In-plane stretch of neo-Hookean F / g with F_zz = 1 and no stress in the plane."""
    material = NeoHookean(**SOFT)

    def stress(stretch: float) -> float:
        F = np.diag([stretch, stretch, 1.0])[:, :, None] / g
        return float(np.asarray(material.first_piola(F, material.params)[0][0]).ravel()[0])

    return float(brentq(stress, 0.9 * g, 1.2 * g, xtol=1e-14))


@pytest.mark.parametrize("where", ["left", "left or right"])
def test_newton_converges_quadratically_while_a_body_swells(where: str) -> None:
    """Twice: the swelling is in the tangent, without which this takes 20 iterations or fails."""
    result = equilibrium(hot("100*X").boundary("clamp", where=where).build())
    assert len(result.steps) == 1
    assert result.iterations <= 7
