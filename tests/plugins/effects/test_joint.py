"""Joints beside springs in series, reflected waves and one body of the same material."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.special import erf

from solidsph import Simulation, solve
from solidsph.errors import BuildError
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.studies.case_run import run_case
from solidsph_cases.stiffness_jump import StiffnessJump

DENSITY, NU = 1000.0, 0.3


def material(youngs_modulus: float, density: float = DENSITY) -> dict[str, object]:
    return {
        "type": "linear-elastic",
        "youngs_modulus": youngs_modulus,
        "poissons_ratio": NU,
        "density": density,
    }


def modulus(youngs_modulus: float) -> float:
    """Confined: lambda + 2 mu."""
    return youngs_modulus * (1 - NU) / ((1 + NU) * (1 - 2 * NU))


def bars(
    one: object, other: object, particles: int = 40, lengths: tuple[float, float] = (1.0, 1.0)
) -> SceneBuilder:
    """Two intervals that touch at X = the first length, joined."""
    first, second = lengths
    return (
        Simulation.builder()
        .scheme("corrected")  # the springs of a joint stand for half a spacing of each body
        .body(
            "left-bar",
            shape={"type": "interval", "length": first},
            spacing=1.0 / particles,
            material=one,
        )
        .body(
            "right-bar",
            shape={"type": "interval", "length": second, "origin": first},
            spacing=1.0 / particles,
            material=other,
        )
        .kernel("cubic-spline", cover=2.6)
        .formulation("total-lagrangian", gradient="corrected")
        .effect("joint")
    )


@pytest.mark.parametrize("ratio", [1.0, 10.0, 1000.0])
def test_two_bars_in_series(ratio: float) -> None:
    """A pull of sigma: the end moves by sigma (L_1 / M_1 + L_2 / M_2)."""
    E, sigma = 1e6, 1e3
    ends = []
    for particles in (20, 40):
        made = (
            bars(material(ratio * E), material(E), particles)
            .boundary("clamp", where="X < 0.5/" + str(particles) + " + 1e-9")
            .boundary("traction", where="X > 2 - 0.6/" + str(particles), traction={"x": sigma})
            .statics()
            .duration(1.0)
            .build()
        )
        X = made.particles.positions[:, 0]
        u = solve(made).state.positions[:, 0] - X
        # Between a particle well inside each bar, what the ends do is left out.
        i, j = np.argmin(np.abs(X - 0.5)), np.argmin(np.abs(X - 1.5))
        expected = sigma * ((1 - X[i]) / modulus(ratio * E) + (X[j] - 1) / modulus(E))
        ends.append((u[j] - u[i]) / expected - 1.0)
    # The springs stand for half a spacing of each: exact, but for how the stress arrives in the
    # outermost particles, a first order in the spacing.
    assert abs(ends[1]) < 0.02
    assert abs(ends[1]) < 0.75 * abs(ends[0]) or abs(ends[1]) < 1e-6


@pytest.mark.parametrize("ratio", [0.05, 1.0, 20.0])
def test_a_wave_is_reflected_by_the_ratio_of_impedances(ratio: float) -> None:
    """Velocity reflected over incident: (Z_1 - Z_2) / (Z_1 + Z_2), transmitted 2 Z_1 / (...)."""
    Z, W = (np.sqrt(modulus(E) * DENSITY) for E in (1e6, ratio * 1e6))
    expected = np.array([(Z - W) / (Z + W), 2.0 * Z / (Z + W)])
    coarse, fine = (np.abs(_divided(ratio, n) - expected) for n in (150, 300))
    # The joint, and the particles beside it, whose gradients are one-sided, are off by a part of a
    # spacing: the first order, 18 spacings being the half width of the pulse in the finer bars.
    assert fine[0] < 0.04
    assert fine[1] < 0.04 * expected[1]
    assert np.all(fine < 0.7 * coarse)


def _divided(ratio: float, particles: int) -> Array:
    """Velocity of what comes back and of what goes on, over that of a pulse."""
    E, width, height = 1e6, 0.06, 1e-4
    c = np.sqrt(modulus(E) / DENSITY)
    made = (
        bars(material(E), material(ratio * E), particles, lengths=(1.0, 1.5))
        # u = -int v / c: a wave that goes to the right only.
        .initial(
            velocity={"x": f"{height}*exp(-((X-0.5)/{width})**2)"},
            displacement={"x": lambda X, t: _going_right(X, 0.5, width, height, c)},
        )
        .duration(0.72 / c)
        .outputs(2)
        .build()
    )
    state = made.run().state
    momentum, start = (made.model.masses @ one.velocities for one in (state, made.initial))
    assert momentum == pytest.approx(start, rel=1e-9)
    X, v = made.particles.positions[:, 0], state.velocities[:, 0]
    back, beyond = v[(X > 0.5) & (X < 0.9)], v[X > 1.0]
    return np.array([one[np.argmax(np.abs(one))] / height for one in (back, beyond)])


def _going_right(X: Array, centre: float, width: float, height: float, c: float) -> Array:
    """Displacement of the wave whose velocity is height exp(-((X - centre) / width)**2)."""
    area = 0.5 * np.sqrt(np.pi) * width * (1.0 + erf((X[:, 0] - centre) / width))
    return -height / c * area


def test_joined_blocks_keep_momentum_and_energy_when_they_spin() -> None:
    builder = Simulation.builder()
    for name, lower in (("below", [0.0, 0.0]), ("above", [0.0, 0.5])):
        builder = builder.body(
            name,
            shape={"type": "box", "lengths": [1.0, 0.5], "origin": lower},
            spacing=0.1,
            material={**material(1e6 if name == "below" else 1e5), "type": "neo-hookean"},
        )
    made = (
        builder.kernel("cubic-spline", cover=2.6)
        .effect("joint")
        .initial(velocity={"x": "-10*(Y-0.5)", "y": "10*(X-0.5)"})
        .integrator("central-difference", time_step_factor=0.25)
        .duration(0.3)
        .outputs(20)
        .build()
    )
    state = made.run().state
    m, x, v = made.model.masses, state.positions, state.velocities
    start = made.initial
    spin, before = (
        float(m @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]))
        for x, v in ((x, v), (start.positions, start.velocities))
    )
    assert spin == pytest.approx(before, rel=1e-4)
    assert np.abs(m @ v).max() < 1e-10 * np.abs(m @ np.abs(v)).max()
    observation = made.dynamics.observe(state)
    energy = [0.5 * float(m @ (one**2).sum(axis=1)) for one in (v, start.velocities)]
    strain = float(made.particles.volumes @ observation.energy_densities)
    # The step's own error, of the second order: 4e-4 at this step.
    assert energy[0] + strain - state.work["joint"] == pytest.approx(energy[1], rel=1e-3)
    # Still one body: without the joint the halves part.
    centres = [x[b.extent].mean(axis=0) for b in made.model.bodies]
    assert np.linalg.norm(np.subtract(*centres)) < 0.6


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"between": ["left-bar", "wall"]}, "there is no body 'wall'"),
        ({"between": ["left-bar"]}, "must name two bodies"),
        ({"reach": 0.5}, "between 1 and 5"),
    ],
)
def test_a_wrong_joint_is_refused_with_a_remedy(change: dict[str, object], said: str) -> None:
    builder = bars(material(1e6), material(1e6)).duration(1.0).effect("joint", **change)
    with pytest.raises(BuildError, match=said):
        builder.build()


def test_bodies_that_do_not_touch_cannot_be_joined() -> None:
    builder = (
        Simulation.builder()
        .body("a", shape={"type": "interval", "length": 1.0}, spacing=0.1)
        .body("b", shape={"type": "interval", "length": 1.0, "origin": 2.0}, spacing=0.1)
        .material(material(1e6))
        .kernel("cubic-spline", cover=2.6)
        .effect("joint")
        .duration(1.0)
    )
    with pytest.raises(BuildError, match="let the bodies touch"):
        builder.build()


@pytest.mark.validation
def test_a_jump_of_a_thousand_converges(tmp_path: Path) -> None:
    """The period of a slab on a soft layer, in the first order of the spacing."""
    errors = []
    for along in (10, 20, 40):
        outcome = run_case(StiffnessJump(along=along, across=4, tolerance=0.05), tmp_path)
        assert outcome.passed
        errors.append(next(m.error for m in outcome.measurements if m.quantity == "period"))
        print(f"{along} along: period off by {100.0 * errors[-1]:.2f} %")
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]
