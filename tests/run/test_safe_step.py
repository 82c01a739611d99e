"""The largest safe step, from a few evaluations of the forces, and the step of a scene."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph import BuildError, Simulation
from solidsph.run.cfl_step import cfl_step
from solidsph.run.dynamics import Dynamics
from solidsph.run.linear_response import LinearResponse
from solidsph.run.safe_step import safe_step
from solidsph.run.spectral_bound import spectral_bound
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.scene.scene_data import DEFAULT_FACTOR
from solidsph.statics import critical_step
from tests.helpers.examples import examples
from tests.helpers.scenes import box, touching

ON_SURFACE = "conforming-lattice"
JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}


def block(d: int, gradient: str, cover: float = 2.6, **body: Any) -> SceneBuilder:
    return (
        box(d, {1: 40, 2: 10, 3: 6}[d], **body)
        .kernel("cubic-spline", cover=cover)
        .formulation("total-lagrangian", gradient=gradient)
    )


def cfl(simulation: Simulation) -> float:
    dynamics, bodies = simulation.dynamics, simulation.model.bodies
    return cfl_step(simulation.integrator, dynamics.loads, bodies)


# --- The bound -----------------------------------------------------------------------------------


@examples(60)
@given(st.integers(1, 12), st.integers(0, 1000))
def test_as_many_vectors_as_unknowns_give_the_largest_eigenvalue(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    A = A @ A.T
    found = spectral_bound(lambda v: A @ v, rng.normal(size=n), least=n, most=n)
    assert found is not None
    assert found.bound == pytest.approx(np.linalg.eigvalsh(A)[-1], rel=1e-8)
    assert A @ found.vector == pytest.approx(found.bound * found.vector, abs=1e-6 * found.bound)


@examples(60)
@given(st.integers(30, 400), st.integers(0, 1000), st.integers(6, 12))
def test_six_vectors_bound_the_spectrum_of_a_lattice(n: int, seed: int, most: int) -> None:
    def springs(v: np.ndarray) -> np.ndarray:
        padded = np.pad(v, 1, mode="edge")
        return 2.0 * v - padded[:-2] - padded[2:]

    start = np.random.default_rng(seed).normal(size=n)
    found = spectral_bound(springs, start, least=most, most=most)
    largest = 2.0 - 2.0 * np.cos(np.pi * (n - 1) / n)  # of free masses on springs
    assert found is not None
    # In 8000 draws six vectors came to 0.93 of it, and with their residual to 0.967 to 1.051.
    assert found.estimate <= largest * (1.0 + 1e-12)
    assert 0.95 * largest <= found.bound <= 1.07 * largest


def test_an_operator_that_is_not_finite_has_no_bound() -> None:
    assert spectral_bound(lambda v: v * np.nan, np.ones(5), least=2, most=5) is None


# --- The safe step -------------------------------------------------------------------------------


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("gradient", ["corrected", "consistent", "quadratic"])
@pytest.mark.parametrize("discretisation", ["lattice", ON_SURFACE, JITTERED], ids=str)
def test_the_safe_step_is_just_below_the_critical_one(
    d: int, gradient: str, discretisation: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluations = 0
    product = LinearResponse.times

    def counted(self: LinearResponse, scaled: np.ndarray) -> np.ndarray:
        nonlocal evaluations
        evaluations += 1
        return product(self, scaled)

    monkeypatch.setattr(LinearResponse, "times", counted)
    simulation = block(d, gradient, discretisation=discretisation).build()
    assert simulation.safe is not None
    assert evaluations <= 30
    # The exact one is known to 5e-4, half the tolerance of its square.
    assert 0.985 < simulation.safe.step / critical_step(simulation).step < 1.0005


@pytest.mark.parametrize(
    ("form", "parts"),
    [
        ("updated-lagrangian", {"gradient": "corrected"}),
        ("updated-lagrangian", {"gradient": "standard"}),
        ("total-lagrangian", {"gradient": "corrected", "divergence": "plain"}),
    ],
)
def test_forms_without_symmetry_have_a_safe_step(form: str, parts: dict[str, str]) -> None:
    simulation = block(2, "corrected").formulation(form, **parts).build()
    assert simulation.safe is not None
    assert 0.9 < simulation.safe.step / critical_step(simulation).step < 1.0005


def test_it_is_the_same_every_time() -> None:
    first, second = (block(2, "consistent").build() for _ in range(2))
    assert first.safe is not None
    assert second.safe is not None
    assert first.safe.step == second.safe.step
    assert np.array_equal(first.safe.mode, second.safe.mode)


def test_a_mode_to_begin_with_is_the_fastest() -> None:
    simulation = block(2, "consistent", discretisation=ON_SURFACE).build()
    safe = simulation.safe
    assert safe is not None
    response = LinearResponse.about(simulation.dynamics, simulation.initial)
    mode = response.scaled(safe.mode)
    square = float(mode @ response.times(mode) / (mode @ mode))
    # A Rayleigh quotient within the gap of the bound, which has a margin of a hundredth.
    highest = simulation.integrator.stability_limit / safe.step
    assert 0.985 * highest**2 < square < highest**2


def test_forces_are_those_of_what_is_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = box(2).build()
    memory = {"a part": np.ones(3)}
    state = attrs.evolve(simulation.initial, memory=memory)
    given = []
    respond = Dynamics.respond

    def seen(self, *arguments, **named):
        given.append(named["memory"])
        return respond(self, *arguments, **named)

    monkeypatch.setattr(Dynamics, "respond", seen)
    assert safe_step(simulation.dynamics, simulation.integrator, state) is not None
    assert given
    assert all(one is memory for one in given)


def test_contact_that_is_not_yet_at_work_shortens_the_step() -> None:
    def built(**contact: Any) -> Simulation:
        builder = touching(2, discretisation="lattice")
        return (builder.effect("contact", **contact) if contact else builder).build()

    apart, meeting = built(), built(friction=0.0)
    (load,) = meeting.dynamics.loads
    assert apart.safe is not None
    assert meeting.safe is not None
    frequencies = [2.0 / one.safe.step for one in (apart, meeting) if one.safe is not None]
    # What touches at the start is measured beside what is declared.
    assert load.stiffness_rate > 0.0
    assert frequencies[1] >= np.hypot(frequencies[0], load.stiffness_rate) * (1.0 - 0.01)


def test_control_is_measured_and_not_declared() -> None:
    plain = block(2, "corrected").build()
    controlled = block(2, "corrected").effect("hourglass-control", strength=0.5).build()
    (load,) = controlled.dynamics.loads
    assert plain.safe is not None
    assert controlled.safe is not None
    declared = 2.0 / np.hypot(2.0 / plain.safe.step, load.stiffness_rate)
    # They do not add up: the waves that control makes faster are not the fastest.
    assert 1.02 * declared < controlled.safe.step < 1.01 * plain.safe.step


def test_damping_shortens_it() -> None:
    free, damped = box(1).build(), box(1).effect("mass-damping", rate=1e3).build()
    assert free.safe is not None
    assert damped.safe is not None
    frequency = 2.0 / free.safe.step
    assert 2.0 / damped.safe.step == pytest.approx(1e3 + np.hypot(1e3, frequency), rel=1e-6)


def test_where_nothing_is_free_the_cfl_step_serves() -> None:
    simulation = box(2).boundary("clamp", where="all").duration(1.0).build()
    assert simulation.safe is None
    # A whole number of steps ends at the duration.
    assert 0.99 < simulation.step_size / (DEFAULT_FACTOR * cfl(simulation)) <= 1.0


def test_an_equilibrium_has_none() -> None:
    builder = box(2).boundary("clamp", where="left").statics()
    assert builder.build().safe is None


# --- The step of a scene -------------------------------------------------------------------------


@pytest.mark.parametrize("gradient", ["corrected", "consistent"])
@pytest.mark.parametrize("factor", [None, 0.3])
def test_the_step_is_a_factor_of_the_smaller_of_two(gradient: str, factor: float | None) -> None:
    builder = block(2, gradient, discretisation=ON_SURFACE).duration(0.5)
    simulation = builder.integrator("velocity-verlet", time_step_factor=factor).build()
    assert simulation.safe is not None
    critical, largest = simulation.safe.step, cfl(simulation)
    assert (critical < largest) == (gradient == "consistent")
    part = simulation.step_size / min(critical, largest)
    assert (factor or DEFAULT_FACTOR) * 0.99 < part <= (factor or DEFAULT_FACTOR)


def test_a_given_step_is_refused_beyond_the_critical_one() -> None:
    builder = block(2, "consistent", discretisation=ON_SURFACE)
    safe = builder.build().safe
    assert safe is not None
    builder.integrator("velocity-verlet", time_step=0.999 * safe.step).build()
    with pytest.raises(BuildError, match=f"exceeds the critical step .* {safe.step:.6g} s"):
        builder.integrator("velocity-verlet", time_step=1.001 * safe.step).build()


def shaken(simulation: Simulation, part: float, steps: int) -> float:
    """Largest velocity after `steps` steps of a part of the safe step, over that at the start."""
    assert simulation.safe is not None
    dynamics = attrs.evolve(simulation.dynamics, step_size=part * simulation.safe.step)
    fixed = attrs.evolve(simulation, dynamics=dynamics, steps=steps)
    # So small a motion that the forces stay linear until it has grown a million times.
    velocities = 1e-10 * np.random.default_rng(1).normal(size=fixed.initial.velocities.shape)
    state = attrs.evolve(fixed, initial=attrs.evolve(fixed.initial, velocities=velocities)).start()
    with np.errstate(all="ignore"):
        for _ in range(steps):
            state = fixed.integrator.advance(state, fixed.dynamics, fixed.step_size)
    return float(np.abs(state.velocities).max() / np.abs(velocities).max())


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("gradient", ["corrected", "consistent", "quadratic"])
def test_a_free_block_is_stable_up_to_the_critical_step(d: int, gradient: str) -> None:
    simulation = block(d, gradient, discretisation=ON_SURFACE).build()
    # Below, the highest mode swings up by at most 1 / sqrt(1 - 0.99^2) = 7, and random velocities
    # put no more than one particle's share into it. Beyond, it grows by (1.04 + sqrt(1.04^2 - 1))^2
    # = 1.76 a step at least, as the safe step may be a hundredth below the critical one.
    assert shaken(simulation, 0.99, 300) < 10.0
    assert not shaken(simulation, 1.05, 60) < 1e4


@pytest.mark.parametrize("time", [1e-5, 1e-4, 1e-3])
def test_strong_damping_is_stable_up_to_the_critical_step(time: float) -> None:
    """The fastest vibration is the one that a dashpot damps fastest, at up to 20 times its
    frequency: the velocity that forces get is late by half a step."""
    simulation = box(1, 12).effect("kelvin-voigt", time=time).build()
    assert shaken(simulation, 0.99, 300) < 10.0
    assert not shaken(simulation, 1.05, 600) < 1e4


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("gradient", ["consistent", "quadratic"])
@pytest.mark.parametrize("cover", [2.5, 3.0, 3.5])
@pytest.mark.parametrize("discretisation", ["lattice", JITTERED], ids=str)
def test_the_default_step_is_stable(
    d: int, gradient: str, cover: float, discretisation: Any
) -> None:
    simulation = block(d, gradient, cover, discretisation=discretisation).build()
    assert simulation.safe is not None
    assert simulation.step_size <= DEFAULT_FACTOR * simulation.safe.step
    # 1 / sqrt(1 - 0.7^2) = 1.4 for every mode, and what several add up to at one particle.
    assert shaken(simulation, simulation.step_size / simulation.safe.step, 200) < 4.0
