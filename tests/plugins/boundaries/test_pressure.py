"""A following pressure beside Lame's thick ring, a homogeneous state and a turned body."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from solidsph import Simulation, solve
from solidsph.errors import BuildError
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics.equilibrium import equilibrium

RUBBER = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}


def block(**pressure: object) -> SceneBuilder:
    builder = (
        Simulation.builder()
        .body(
            "block",
            shape={"type": "box", "lengths": [1.0, 0.8]},
            spacing=0.1,
            discretisation="fitted",
        )
        .kernel("cubic-spline", cover=2.6)
        .formulation("total-lagrangian", gradient="consistent")
        .material("neo-hookean", **RUBBER)
    )
    for where, value in pressure.items():
        builder = builder.boundary("pressure", where=where, pressure=value)
    return builder


def test_pressure_all_round_makes_the_cauchy_stress_hydrostatic() -> None:
    """Half of the block between two planes of symmetry, at rest: sigma = -p, F = s I."""
    p = 3e5
    made = (
        block(right=p, top=p)
        .boundary("prescribed-motion", where="left", displacement={"x": 0.0})
        .boundary("prescribed-motion", where="bottom", displacement={"y": 0.0})
        .statics(load_steps=2)
        .duration(1.0)
        .build()
    )
    state = solve(made).state
    observation = made.dynamics.observe(state)
    lam, mu = made.model.bodies[0].material.lame_parameters

    def sigma(s: float) -> float:
        return (mu * (s**2 - 1.0) + 2.0 * lam * np.log(s)) / s**2

    s = brentq(lambda s: sigma(s) + p, 0.5, 1.0)
    # Newton's tolerance, and the consistent gradient's 1e-9 of a constant stress.
    assert np.abs(observation.deformation_gradients - s * np.eye(2)).max() < 1e-7
    # A dead load of the same size would not be a pressure any more: 18 % less area.
    assert abs(s - 1.0) > 0.1
    reports = [c.report(observation) for c in made.terms if "pressure" in c.label]
    for one in reports:
        asked, achieved = (
            next(v for k, v in one.items() if w in k) for w in ("asked [Pa]", "stress [Pa]")
        )
        assert asked == pytest.approx(p)
        assert achieved == pytest.approx(p, rel=1e-5)


def test_a_thick_ring_under_inner_pressure_is_lames() -> None:
    a, b, p, E, nu = 0.5, 1.0, 1e3, 1e6, 0.3
    made = (
        Simulation.builder()
        .body(
            "ring",
            shape={"type": "annulus", "inner_radius": a, "outer_radius": b},
            spacing=0.05,
            discretisation={"type": "conforming-lattice"},
        )
        .kernel("cubic-spline", cover=2.6)
        .formulation("total-lagrangian", gradient="consistent")
        .material("neo-hookean", **RUBBER)
        .boundary("pressure", where="inner", pressure=p)
        # Three displacements keep it in place, by symmetry without reaction.
        .boundary("prescribed-motion", where="X > 0.99 and abs(Y) < 0.01", displacement={"y": 0.0})
        .boundary("prescribed-motion", where="X < -0.99 and abs(Y) < 0.01", displacement={"y": 0.0})
        .boundary("prescribed-motion", where="Y > 0.99 and abs(X) < 0.01", displacement={"x": 0.0})
        .statics()
        .duration(1.0)
        .build()
    )
    state = solve(made).state
    X = made.particles.positions
    r = np.linalg.norm(X, axis=1)
    u = np.einsum("ni,ni->n", state.positions - X, X) / r
    for radius in (a, b):
        at = np.abs(r - radius) < 1e-9
        expected = (
            p * a**2 / (E * (b**2 - a**2)) * (1 + nu) * ((1 - 2 * nu) * radius + b**2 / radius)
        )
        # Ten particles across the wall; the strain is p / E = 1e-3.
        assert u[at].mean() == pytest.approx(expected, rel=0.02)


def test_it_turns_with_the_body_and_leaves_a_closed_surface_alone() -> None:
    made = block(left=1e4, right=1e4, top=1e4, bottom=1e4).duration(1e-4).build()
    X = made.particles.positions
    angle = 1.2
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    F = np.array([[1.2, 0.1], [-0.2, 0.9]])
    still, total = np.zeros_like(X), np.zeros(2)
    for load in made.dynamics.loads:
        there = load.forces(0.0, X @ F.T, still)
        turned = load.forces(0.0, X @ (Q @ F).T, still)
        assert np.abs(turned - there @ Q.T).max() < 1e-12 * np.abs(there).max()
        total += there.sum(axis=0)
    assert np.abs(total).max() < 1e-12 * 1e4


def test_the_updated_form_and_a_wrong_place_are_refused() -> None:
    with pytest.raises(BuildError, match="use 'total-lagrangian'"):
        block(left=1.0).formulation("updated-lagrangian").duration(1.0).build()
    with pytest.raises(BuildError, match="lies on the surface"):
        block(**{"abs(X - 0.5) < 0.01 and abs(Y - 0.4) < 0.01": 1.0}).duration(1.0).build()


def test_newton_converges_quadratically_under_it() -> None:
    """Its stiffness is not symmetric where its surface ends; the symmetric part alone takes 11
    iterations, and finds nothing near incompressibility."""
    quarter = {
        "type": "difference",
        "of": {"type": "annulus", "inner_radius": 1.0, "outer_radius": 2.0},
        "minus": [
            {"type": "box", "lengths": [3.0, 6.0], "origin": [-3.0, -3.0]},
            {"type": "box", "lengths": [6.0, 3.0], "origin": [-3.0, -3.0]},
        ],
    }
    made = (
        Simulation.builder()
        .body("ring", shape=quarter, spacing=1.0 / 7.0)
        .material("neo-hookean", **RUBBER)
        .boundary("pressure", where="inner", pressure=1.4e5)
        .boundary("symmetry", axis="x")
        .boundary("symmetry", axis="y")
        .statics()
        .duration(1.0)
        .build()
    )
    found = equilibrium(made)
    u = found.state.positions - made.particles.positions
    assert np.abs(u).max() > 0.4  # far beyond small displacements
    assert found.iterations <= 5
