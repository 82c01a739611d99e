"""Formulations: the conformance kit for every combination with a gradient and a divergence.

Then what only time shows: momentum and energy over a run, with every integrator; and that
formulations are different sums for one continuum.
"""

from __future__ import annotations

from itertools import combinations

import attrs
import numpy as np
import pytest

from solidsph import BuildError, Simulation, State
from solidsph.interfaces.formulation import Configuration
from solidsph.maths.arrays import Array
from solidsph.registry import registry
from solidsph.testing import conformance, example_part
from tests.helpers.scenes import REFERENCE_ONLY

JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}
LENGTHS = {1: [1.2], 2: [0.7, 0.6], 3: [0.5, 0.4, 0.4]}

every_formulation = pytest.mark.parametrize("name", registry.names("formulations"))
every_gradient = pytest.mark.parametrize("gradient", registry.names("gradients"))
every_moving_gradient = pytest.mark.parametrize(
    "gradient", [name for name in registry.names("gradients") if name not in REFERENCE_ONLY]
)
every_divergence = pytest.mark.parametrize("divergence", registry.names("divergences"))
every_integrator = pytest.mark.parametrize("integrator", registry.names("integrators"))
every_pair = pytest.mark.parametrize(
    ("one", "other"), list(combinations(registry.names("formulations"), 2))
)


def free_body(
    formulation: object,
    *,
    lengths: list[float],
    spacing: float = 0.1,
    cover: float = 2.6,
    discretisation: object = JITTERED,
    integrator: str = "velocity-verlet",
) -> Simulation:
    return (
        Simulation.builder()
        .body(
            "body",
            shape={"type": "box", "lengths": lengths},
            spacing=spacing,
            discretisation=discretisation,
        )
        .kernel("modified-mollifier", cover=cover)
        .material(example_part("materials", "neo-hookean"))
        .formulation(formulation)
        .integrator(integrator)
        .duration(1.0)
        .build()
    )


def smooth_displacement(X: Array) -> Array:
    d = X.shape[1]
    waves = 3.0 * np.random.default_rng(d).normal(size=(d, d))
    return 0.05 * np.sin(X @ waves + 1.0)


@every_formulation
@every_gradient
@every_divergence
def test_conformance(name: str, gradient: str, divergence: str) -> None:
    part = example_part("formulations", name, gradient=gradient, divergence=divergence)
    if gradient in REFERENCE_ONLY and part.configuration is not Configuration.REFERENCE:
        with pytest.raises(BuildError, match=f"{gradient}.* use 'total-lagrangian'"):
            free_body(part, lengths=LENGTHS[2])
        return
    assert [result for result in conformance("formulations", part) if not result.passed] == []


@every_formulation
@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_with_the_standard_gradient_plain_and_variational_are_the_same(
    name: str, dimension: int
) -> None:
    plain, variational = (
        free_body(
            {"type": name, "gradient": "standard", "divergence": divergence},
            lengths=LENGTHS[dimension],
        )
        for divergence in ("plain", "variational")
    )
    u = smooth_displacement(plain.particles.positions)
    expected = plain.dynamics.internal.forces(0.0, u)
    found = variational.dynamics.internal.forces(0.0, u)
    # The same products, rounded and added in another order.
    assert np.abs(found - expected).max() < 1e-14 * np.abs(expected).max()


@every_pair
@every_moving_gradient
@every_divergence
def test_formulations_have_one_linear_limit(
    one: str, other: str, gradient: str, divergence: str
) -> None:
    bodies = [
        free_body(
            {"type": name, "gradient": gradient, "divergence": divergence},
            lengths=LENGTHS[2],
            cover=3.5,  # enough for second derivatives at corners
        )
        for name in (one, other)
    ]
    u = smooth_displacement(bodies[0].particles.positions)
    sizes = np.array([1e-2, 1e-3, 1e-4])
    differences = []
    for size in sizes:
        a, b = (body.dynamics.internal.forces(0.0, size * u) for body in bodies)
        differences.append(np.abs(a - b).max() / np.abs(a).max())
    slope = np.polyfit(np.log(sizes), np.log(differences), 1)[0]
    # The next term of an expansion is of the relative size of the displacement.
    assert slope == pytest.approx(1.0, abs=0.02)


@every_pair
def test_formulations_approach_each_other_under_refinement(one: str, other: str) -> None:
    differences = []
    for cells in (16, 32):
        bodies = [
            free_body(name, lengths=[1.0, 1.0], spacing=1.0 / cells, discretisation="lattice")
            for name in (one, other)
        ]
        # Flat at the surfaces, where the forms differ by more than by discretisation.
        X = bodies[0].particles.positions
        u = 0.03 * np.prod(np.sin(np.pi * X) ** 4, axis=1)[:, None] * np.ones(2)
        a, b = (body.dynamics.internal.forces(0.0, u) for body in bodies)
        differences.append(np.abs(a - b).max() / np.abs(a).max())
    # Between the first and the second order; strains reach 20 % of large displacements here.
    assert differences[1] < 0.5 * differences[0]
    assert differences[1] < 0.03


def stirred(simulation: Simulation, speed: float) -> State:
    """A random velocity of every particle, of `speed` in units of the wave speed."""
    wave_speed = simulation.model.bodies[0].material.wave_speed
    noise = np.random.default_rng(7).normal(size=simulation.initial.positions.shape)
    return attrs.evolve(simulation.initial, velocities=speed * wave_speed * noise)


@every_formulation
@every_integrator
@pytest.mark.parametrize("dimension", [1, 2, pytest.param(3, marks=pytest.mark.validation)])
def test_a_free_body_keeps_its_momentum(name: str, integrator: str, dimension: int) -> None:
    body = free_body(
        {"type": name, "gradient": "corrected", "divergence": "variational"},
        lengths=LENGTHS[dimension],
        integrator=integrator,
    )
    m, dynamics = body.dynamics.masses, body.dynamics

    def momenta(state: State) -> tuple[Array, Array]:
        x, p = state.positions, m[:, None] * state.velocities
        moments = x.T @ p
        return p.sum(axis=0), moments - moments.T

    # Slow enough that no particle loses its neighbours within the run.
    state = body.integrator.start(stirred(body, 0.002), dynamics, body.step_size)
    linear, angular = momenta(state)
    largest = 0.0
    for _ in range(1000):
        state = body.integrator.advance(state, dynamics, body.step_size)
        largest = max(largest, float(np.abs(state.positions - body.initial.positions).max()))
    assert largest > 0.1 * 0.1, "it has hardly moved: less than a tenth of the spacing"
    new_linear, new_angular = momenta(state)
    # Rounding of 1e-16 a step, a thousand steps in random directions: thirty in one.
    sizes = m[:, None] * np.abs(state.velocities)
    arms = np.abs(state.positions).sum(axis=1, keepdims=True)
    assert np.abs(new_linear - linear).max() < 3e-14 * sizes.sum()
    assert np.abs(new_angular - angular).max() < 3e-14 * np.sum(arms * sizes)


@every_integrator
def test_energy_error_falls_with_the_square_of_the_step(integrator: str) -> None:
    body = free_body("total-lagrangian", lengths=LENGTHS[2], integrator=integrator)
    X, m = body.particles.positions, body.dynamics.masses
    volumes = body.particles.volumes
    wave_speed = body.model.bodies[0].material.wave_speed
    start = attrs.evolve(
        body.initial, velocities=0.02 * wave_speed * np.sin(3.0 * X[:, ::-1]) * [1.0, -1.0]
    )

    def energy(state: State) -> float:
        fields = body.dynamics.internal.fields(state.positions - X)
        return float(
            0.5 * m @ np.sum(state.velocities**2, axis=1) + volumes @ fields.energy_densities
        )

    duration, counts, errors = 100.0 * body.step_size, (100, 200, 400), []
    for count in counts:
        step_size = duration / count
        state = body.integrator.start(start, body.dynamics, step_size)
        first, error = energy(state), 0.0
        for _ in range(count):
            state = body.integrator.advance(state, body.dynamics, step_size)
            error = max(error, abs(energy(state) / first - 1.0))
        errors.append(error)
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # Next term: (omega dt)^2 of the waves excited, a few percent.
    order = body.integrator.order
    assert slope == pytest.approx(order, abs=0.1), f"errors {errors}"
