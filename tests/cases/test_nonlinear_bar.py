"""Waves of finite amplitude: their exact solutions themselves, and the bar of particles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize_scalar

from solidsph import Record, SceneError
from solidsph.simulation import Simulation
from solidsph.studies.case import Measurement
from solidsph.studies.case_run import CaseResult, run_case
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._bar import along
from solidsph_cases.nonlinear_bar import (
    NonlinearBar,
    exact_profile,
    half_speed,
    overshoot,
    plateau,
    viscous_power,
)

MATERIAL = NeoHookean(200e9, 0.3, 8000.0)
LAW = NonlinearBar().law
C = LAW.small_speed
VELOCITIES = [0.01, 0.1, 0.3, 0.5]  # [confined wave speeds]


# --- The law -------------------------------------------------------------------------------------


def test_the_law_is_the_papers_in_uniaxial_strain() -> None:
    s = np.linspace(0.3, 3.0, 100)
    params = MATERIAL.params
    assert MATERIAL.first_piola(((s,),), params)[0][0] == pytest.approx(LAW.stress(s), rel=1e-12)
    slope = MATERIAL.tangent(((s,),), ((np.ones(100),),), params)[0][0]
    assert slope == pytest.approx(LAW.stiffness(s), rel=1e-12)
    energy = np.array([LAW.energy(one) for one in s])
    assert MATERIAL.energy(((s,),), params) == pytest.approx(energy, rel=1e-12)
    assert MATERIAL.wave_speed == pytest.approx(C)


def test_it_is_concave_up_to_where_it_says() -> None:
    last = LAW.last_concave
    assert last == pytest.approx(8.73, abs=0.01)
    found = minimize_scalar(LAW.stiffness, bounds=(2.0, 20.0), method="bounded")
    # The minimum is flat: the root of the tolerance of its values.
    assert found.x == pytest.approx(last, rel=1e-3)
    assert LAW.stiffness(last) > 0.0  # the law stays hyperbolic
    # The pulls of the case, 0.5 c at most, are far within the range of a fan alone.
    s = np.linspace(1.0, last, 100_001)
    assert LAW.largest_pull == pytest.approx(np.trapezoid(LAW.speed(s), s), rel=1e-8)
    assert LAW.largest_pull > 4.0 * C


# --- Shocks --------------------------------------------------------------------------------------


@pytest.mark.parametrize("velocity", VELOCITIES)
def test_a_shock_keeps_momentum_and_compatibility(velocity: float) -> None:
    shock = LAW.pushed(velocity * C)
    jump = LAW.stress(1.0) - LAW.stress(shock.stretch)  # ahead less behind
    momentum = jump + LAW.density * shock.head * (0.0 - shock.velocity)
    compatibility = (0.0 - shock.velocity) + shock.head * (1.0 - shock.stretch)
    # The root is that of 1 - s, some 1e-2 at least, to 1e-15.
    assert abs(momentum) < 1e-12 * abs(jump)
    assert abs(compatibility) < 1e-12 * shock.velocity


@pytest.mark.parametrize("velocity", VELOCITIES)
def test_a_shock_is_caught_up_and_loses_energy(velocity: float) -> None:
    """Lax's condition, and what is lost is the area between P and its chord."""
    shock = LAW.pushed(velocity * C)
    assert C < shock.head < LAW.speed(shock.stretch)
    s = shock.stretch

    def chord(r: float) -> float:
        return float(LAW.stress(s)) * (1.0 - r) / (1.0 - s)

    area = quad(lambda r: chord(r) - float(LAW.stress(r)), s, 1.0, epsabs=0.0)[0]
    assert area < 0.0  # P lies above its chord
    # A difference of energies: rounding over the third power of the strain.
    assert shock.dissipation == pytest.approx(-shock.head * area, rel=1e-9 / velocity**2)
    assert shock.dissipation > 0.0


# --- Fans ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("velocity", VELOCITIES)
def test_a_fan_solves_the_equations_of_motion(velocity: float) -> None:
    """Momentum in X / t, integrated by a solver that knows P alone, ends at the velocity asked."""
    fan = LAW.pulled(velocity * C)
    assert fan.tail < fan.half_speed < fan.head == pytest.approx(C)

    def rates(s: float, y: list[float]) -> list[float]:
        return [-np.sqrt(float(LAW.stiffness(s)) / LAW.density)]

    v = solve_ivp(rates, (1.0, fan.stretch), [0.0], rtol=1e-12, atol=1e-9).y[0, -1]
    assert v == pytest.approx(-velocity * C, rel=1e-9)
    xi = np.linspace(fan.tail, fan.head, 50)
    s = fan.stretches(xi)
    assert LAW.speed(s) == pytest.approx(xi, rel=1e-12)
    assert np.all(np.diff(s) <= 0.0)
    assert fan.stresses(np.array([0.5 * fan.tail, 2.0 * fan.head])) == pytest.approx(
        [fan.stress, 0.0]
    )


@pytest.mark.parametrize("velocity", VELOCITIES)
def test_impulse_is_momentum(velocity: float) -> None:
    """rho times the integral of v over X / t is -P at the end, in shocks and in fans."""
    for wave in (LAW.pushed(velocity * C), LAW.pulled(velocity * C)):
        # By parts: X / t times the change of v, and -dv = c ds in the fan.
        inner = quad(lambda s: float(LAW.speed(s)) ** 2, 1.0, wave.stretch)[0]
        momentum = (wave.velocity * wave.head if wave.velocity > 0.0 else -inner) * LAW.density
        assert momentum == pytest.approx(-wave.stress, rel=1e-9)


def test_small_amplitudes_are_linear() -> None:
    for v in (1e-4, 1e-5):
        for wave in (LAW.pushed(v * C), LAW.pulled(v * C)):
            # The first correction is P'' / P' v / 2, with P'' = -3 lambda - 2 mu.
            slack = 2.0 * v
            assert wave.stress == pytest.approx(-LAW.density * C * wave.velocity, rel=slack)
            assert wave.stretch - 1.0 == pytest.approx(-wave.velocity / C, rel=slack)
            assert wave.half_speed == pytest.approx(C, rel=slack)


def test_shock_and_fan_differ_in_the_third_order_only() -> None:
    """The Hugoniot touches the simple wave's curve to the second order."""
    differences = []
    for v in (0.1, 0.05, 0.025):
        s = LAW.pushed(v * C).stretch
        isentropic = -LAW.fan_velocity(s) / C  # of a compression that were a simple wave
        differences.append(abs(v - isentropic))
    orders = np.log2(np.array(differences[:-1]) / differences[1:])
    assert orders == pytest.approx(3.0, abs=0.2)


def test_a_pull_out_of_range_says_so() -> None:
    with pytest.raises(SceneError, match=r"no longer concave; the largest that is a simple wave"):
        LAW.pulled(5.0 * C)


# --- The case ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> CaseResult:
    return run_case(NonlinearBar(particles=101), tmp_path_factory.mktemp("nonlinear"))


def found(outcome: CaseResult, words: str) -> list[Measurement]:
    return [m for m in outcome.measurements if words in m.quantity]


def test_a_hundred_particles_keep_within_every_bar(coarse: CaseResult) -> None:
    assert coarse.passed, [m for m in coarse.measurements if not m.passed]
    assert [len(found(coarse, words)) for words in ("plateau", "speed", "power")] == [21, 6, 3]


def test_compression_is_faster_than_tension_and_each_as_it_should_be(coarse: CaseResult) -> None:
    speeds = {m.quantity.partition(":")[0]: m.value / C for m in found(coarse, "speed")}
    assert speeds["push-0.5"] > 1.25
    assert speeds["pull-0.5"] < 0.85


def test_shocks_need_viscosity_and_fans_hardly(coarse: CaseResult) -> None:
    bare = {m.quantity.partition(":")[0]: m for m in found(coarse, "without viscosity")}
    viscous = {
        m.quantity.partition(":")[0]: m.value
        for m in found(coarse, "overshoot")
        if "without" not in m.quantity
    }
    assert max(viscous[f"push-{v}"] for v in (0.1, 0.3, 0.5)) < 0.01
    # The end of a pulled bar, half a particle, rings from the jump of its velocity at the start.
    assert max(viscous.values()) < 0.05
    assert all(m.value < 0.03 for m in found(coarse, "profile") if m.quantity.startswith("pull"))
    assert bare["push-0.3"].value > 0.4
    assert bare["push-0.5"].value > 1.0
    # Pulled, the end particle alone rings, from the jump of its velocity at the start.
    for v in (0.1, 0.3, 0.5):
        assert bare[f"pull-{v}"].value < 0.7 * bare[f"push-{v}"].value


def test_pictures_and_tables_are_there(coarse: CaseResult) -> None:
    assert len(coarse.pictures) == 2
    for picture in coarse.pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.stat().st_size > 20_000
    assert len(coarse.tables) == 6


def test_a_shock_is_not_what_linear_theory_says(tmp_path: Path) -> None:
    """With the linear law the same push misses the plateau: the measurement would notice."""
    case, path = NonlinearBar(velocities=(0.3,), particles=51), tmp_path / "linear.h5"
    scene = case.scenes()["push-0.3"]
    linear = Simulation.builder(scene).material(
        "linear-elastic", youngs_modulus=200e9, poissons_ratio=0.3, density=8000.0
    )
    linear.build().run(record=path)
    wave = case.wave(0.3)
    with Record(path) as record:
        assert plateau(record, wave) / wave.stress < 0.95
        assert half_speed(record, wave) / wave.half_speed < 0.95


def test_a_run_that_ended_early_measures_nothing(tmp_path: Path) -> None:
    case, path = NonlinearBar(velocities=(0.1,), particles=51), tmp_path / "short.h5"
    scene = case.scenes()["push-0.1"]
    Simulation.builder(scene).duration(1e-9).outputs(1).build().run(record=path)
    wave = case.wave(0.1)
    with Record(path) as record:
        assert np.isnan(plateau(record, wave))
        assert np.isnan(half_speed(record, wave))
        assert np.isnan(viscous_power(record))
        assert overshoot(record, wave) < 0.0
        assert exact_profile(record, wave)[1:] == pytest.approx(np.zeros(len(along(record)) - 1))


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"velocities": (5.0,)}, "no longer concave"),
        ({"velocities": (1.5,)}, "take at most 1"),
        ({"velocities": (0.0,)}, "a velocity must be positive"),
        ({"particles": 20}, "at least 51, got 20"),
    ],
)
def test_a_wrong_parameter_is_one_clear_message(parameters: dict, expected: str) -> None:
    with pytest.raises(SceneError, match=expected):
        NonlinearBar(**parameters)


@pytest.mark.validation
def test_every_bar_holds_at_every_resolution_and_profiles_approach(tmp_path: Path) -> None:
    errors = []
    for particles in (101, 201, 401):
        outcome = run_case(NonlinearBar(particles=particles), tmp_path / str(particles))
        for m in outcome.measurements:
            print(f"{particles} particles: {m.quantity} = {m.value:.6g} {m.unit}, error {m.error}")
        assert outcome.passed, [m for m in outcome.measurements if not m.passed]
        errors.append([m.value for m in found(outcome, "root mean square")])
    found_at = np.array(errors)
    # A fan that happens to fit few particles gains nothing from twice as many.
    assert np.all(found_at[1:] < 1.05 * found_at[:-1]), errors
    assert np.all(found_at[-1] < 0.6 * found_at[0]), errors
