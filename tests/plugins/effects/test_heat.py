"""Conduction beside Fourier's solutions, swelling beside states in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from solidsph import Record, Simulation, solve
from solidsph.errors import BuildError
from solidsph.scene.scene_builder import SceneBuilder

STEEL = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}
# Diffusivity k / (rho c) of 2 m^2/s: fast, so that a test is short.
FAST = {"conductivity": 2e3, "heat_capacity": 1.0}


def bar(particles: int = 40, **heat: object) -> SceneBuilder:
    return (
        Simulation.builder()
        # Particles in the middles of their cells: those on the surface have half the volume, and
        # half the neighbours, so that heat enters at a held end as through 1.7 spacings more.
        .scheme("corrected")
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=1.0 / particles)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", **STEEL)
        .effect("heat", **{**FAST, **heat})
        .duration(0.02)
        .outputs(4)
    )


def temperature(builder: SceneBuilder, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Places and temperatures at the end."""
    builder.build().run(record=path)
    with Record(path) as record:
        return record.particles.positions[:, 0], record.field("heat temperature")[-1]


@pytest.mark.parametrize("particles", [20, 40])
def test_an_insulated_bar_evens_out_as_fourier_says(particles: int, tmp_path: Path) -> None:
    X, T = temperature(bar(particles, initial="100 + 50*cos(pi*X)"), tmp_path / "r.h5")
    expected = 100.0 + 50.0 * np.cos(np.pi * X) * np.exp(-2.0 * np.pi**2 * 0.02)
    # Second order inside; at the ends, where half the neighbours are missing, the first.
    assert np.abs(T - expected).max() < 50.0 * 2.0 / particles
    assert T.mean() == pytest.approx(100.0, rel=1e-12)  # what one loses the other gains
    assert np.ptp(T) < 0.8 * 100.0


def test_a_bar_held_cold_at_both_ends(tmp_path: Path) -> None:
    held = [{"where": "left", "temperature": 0.0}, {"where": "right", "temperature": 0.0}]
    builder = bar(40, initial="50*sin(pi*(X-0.0125)/0.975)", held=held)
    X, T = temperature(builder, tmp_path / "r.h5")
    k = np.pi / 0.975  # from the outermost particle to the other, which are held
    expected = 50.0 * np.sin(k * (X - 0.0125)) * np.exp(-2.0 * k**2 * 0.02)
    assert np.abs(T - expected).max() < 0.01 * 50.0


def test_a_steady_source_between_cold_walls(tmp_path: Path) -> None:
    """T = q x (L - x) / (2 k) in the end."""
    held = [{"where": "left", "temperature": 0.0}, {"where": "right", "temperature": 0.0}]
    builder = bar(40, source=1e5, held=held).duration(1.0)
    X, T = temperature(builder, tmp_path / "r.h5")
    expected = 1e5 * (X - 0.0125) * (0.9875 - X) / (2.0 * 2e3)
    # The held particle has half the neighbours of one inside: half a spacing's worth of heat.
    assert np.abs(T - expected).max() < 0.02 * expected.max()


@pytest.mark.parametrize("d", [2, 3])
def test_heat_is_conserved_and_flows_in_every_direction(d: int) -> None:
    made = (
        Simulation.builder()
        .scheme("corrected")
        .body("block", shape={"type": "box", "lengths": [1.0, 0.6, 0.5][:d]}, spacing=0.1)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", **STEEL)
        .effect("heat", **FAST, initial="100*X + 20*sin(9*Y)")
        .duration(0.02)
        .build()
    )
    begun, done = made.start(), made.run().state
    (name,) = [key for key in begun.memory if "temperature" in key]
    before, after = begun.memory[name], done.memory[name]
    masses = made.model.masses
    assert masses @ after == pytest.approx(masses @ before, rel=1e-12)
    assert np.ptp(after) < 0.7 * np.ptp(before)
    assert after.max() <= before.max()  # no place gets hotter than the hottest
    assert after.min() >= before.min()


def test_a_hindered_bar_has_the_stress_of_the_law() -> None:
    """Both ends held: F = 1, P = g^2 P(1 / g) of the whole body's law, exactly."""
    expansion, T = 2e-4, 150.0
    made = (
        bar(20, initial=T, expansion=expansion)
        .boundary("clamp", where="left")
        .boundary("clamp", where="right")
        .build()
    )
    (heat,) = made.dynamics.loads
    X = made.particles.positions
    force = heat.forces(0.0, X, np.zeros_like(X))
    material = made.model.bodies[0].material
    g = 1.0 + expansion * T
    F = np.eye(3)[:, :, None] / g
    P = g**2 * np.asarray(material.first_piola(F, material.params)[0][0])
    # Inside, where the stress is even, it pushes nothing; all of it arrives at the ends.
    assert np.abs(force[5:15]).max() < 1e-12 * abs(P)
    assert force[:5].sum() == pytest.approx(float(P[0]), rel=1e-12)
    lam, mu = material.lame_parameters
    small = -(3.0 * lam + 2.0 * mu) * expansion * T
    assert force[:5].sum() == pytest.approx(small, rel=0.1)  # by the linear theory


def test_a_free_sheet_swells_without_stress_in_its_plane() -> None:
    """Plane strain: F = s I with g^2 P(F / g) = 0 in the plane, a root of the law."""
    expansion, T = 2e-4, 150.0
    made = (
        Simulation.builder()
        .body(
            "sheet",
            shape={"type": "box", "lengths": [1.0, 0.6]},
            spacing=0.1,
            discretisation={"type": "lattice", "on_boundary": True},
        )
        .kernel("cubic-spline", cover=2.6)
        .formulation("total-lagrangian", gradient="consistent")
        .material("neo-hookean", **STEEL)
        .effect("heat", **FAST, initial=T, expansion=expansion)
        .boundary("prescribed-motion", where="left", displacement={"x": 0.0})
        .boundary("prescribed-motion", where="bottom", displacement={"y": 0.0})
        .statics()
        .duration(1.0)
        .build()
    )
    state = solve(made).state
    lam, mu = made.model.bodies[0].material.lame_parameters
    g = 1.0 + expansion * T

    def stress(s: float) -> float:
        f, across = s / g, 1.0 / g
        return mu * (f - 1.0 / f) + lam * np.log(f * f * across) / f

    s = brentq(stress, 1.0, 1.5)
    found = made.dynamics.observe(state).deformation_gradients
    assert np.abs(found - s * np.eye(2)).max() < 1e-7
    assert s == pytest.approx(1.0 + 1.3 * expansion * T, rel=2e-3)  # (1 + nu) alpha T


def test_swelling_is_refused_for_what_remembers() -> None:
    prony = [{"share": 0.3, "time": 1.0}]
    builder = bar(20, expansion=1e-5).material("viscoelastic", **STEEL, prony=prony)
    with pytest.raises(BuildError, match="set expansion = 0"):
        builder.build()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"held": "left"}, "takes a list"),
        ({"held": [{"where": "left"}]}, "got the entry"),
        ({"conductivity": -1.0}, "conductivity must be positive"),
        ({"expansion": 1.0}, "must stay below 0.5"),
        ({"initial": "t +"}, "cannot be read"),
    ],
)
def test_wrong_parameters_are_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(BuildError, match=said):
        bar(20, **change).build()
