"""Section 5.1: d'Alembert's solution itself, and the bar of particles beside it."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np
import pytest

from solidsph import Record, SceneError
from solidsph.maths.formulas import Expression
from solidsph.simulation import Simulation
from solidsph.studies.case import Measurement
from solidsph.studies.case_run import CaseResult, run_case
from solidsph_cases._bar import LENGTH, first_rise
from solidsph_cases._bar_histories import Histories
from solidsph_cases._bar_waves import FREE, HELD, BarWaves, Pulse, smooth_pulse, square_pulse
from solidsph_cases.wave_bar import PAPER, READINGS, STRAIN, WaveBar

PULSE = 10e-6  # [s]
C, RHO = STRAIN.speed, 8000.0


def waves(pulse: Pulse, left: float = FREE) -> BarWaves:
    return BarWaves(LENGTH, C, RHO, -100e3, pulse, left)


# --- The exact solution --------------------------------------------------------------------------


@pytest.mark.parametrize("left", [FREE, HELD])
def test_the_solution_keeps_momentum_and_compatibility(left: float) -> None:
    """rho v_t = T_X and T_t = rho c^2 v_X, by differences, through reflections at both ends."""
    exact = waves(smooth_pulse(PULSE), left)
    X, t = np.linspace(0.01, 0.14, 60), np.linspace(1e-6, 150e-6, 240)[:, None]
    step = 1e-8  # s

    def rates(field):
        in_time = (field(X, t + step) - field(X, t - step)) / (2.0 * step)
        in_space = (field(X + C * step, t) - field(X - C * step, t)) / (2.0 * C * step)
        return in_time, in_space

    T_t, T_X = rates(exact.stress)
    v_t, v_X = rates(exact.velocity)
    # Differences miss (pi step / pulse)^2, some 1e-5 of the rates, and where the pulse begins, its
    # second derivative jumps: (2 pi / pulse) step.
    assert np.abs(RHO * v_t - T_X).max() < 1e-2 * np.abs(T_X).max()
    assert np.abs(T_t - RHO * C**2 * v_X).max() < 1e-2 * np.abs(T_t).max()


def test_the_ends_do_what_they_are_told() -> None:
    t = np.linspace(0.0, 200e-6, 4001)
    pulse = smooth_pulse(PULSE)
    for left in (FREE, HELD):
        at_wall = waves(pulse, left).velocity(np.array(LENGTH), t)
        assert np.abs(at_wall).max() < 1e-12  # m/s; the pulse moves at 2e-3
    loaded = waves(pulse).stress(np.array(0.0), t)
    assert loaded == pytest.approx(-100e3 * pulse.value(t), abs=1e-6)
    moved = waves(pulse, HELD).velocity(np.array(0.0), t)
    assert moved == pytest.approx(100e3 / (RHO * C) * pulse.value(t), abs=1e-12)


def test_the_wall_doubles_and_a_free_end_turns_the_sign() -> None:
    transit = LENGTH / C
    middle = 0.5 * PULSE
    for pulse in (smooth_pulse(PULSE), square_pulse(PULSE)):
        free, held = waves(pulse), waves(pulse, HELD)
        for exact in (free, held):
            wall = exact.stress(np.array(LENGTH), np.array(transit + middle))
            assert wall == pytest.approx(-200e3)
        back = np.array(2.0 * transit + 0.05 / C + middle)
        assert free.stress(np.array(0.05), back) == pytest.approx(100e3)
        assert held.stress(np.array(0.05), back) == pytest.approx(-100e3)


@pytest.mark.parametrize("left", [FREE, HELD])
def test_energy_is_what_the_end_supplied(left: float) -> None:
    exact = waves(smooth_pulse(PULSE), left)
    X = np.linspace(0.0, LENGTH, 6001)
    supplied = 100e3**2 / (RHO * C) * PULSE * 3.0 / 8.0  # the mean of sin^4
    for time in (15e-6, 40e-6, 65e-6, 100e-6):
        T, v = exact.stress(X, np.array(time)), exact.velocity(X, np.array(time))
        energy = np.trapezoid(0.5 * RHO * v**2 + 0.5 * T**2 / (RHO * C**2), X)
        # The trapezoidal rule on a function whose third derivative is bounded.
        assert energy == pytest.approx(supplied, rel=1e-6)


@pytest.mark.parametrize("pulse", [smooth_pulse(PULSE), square_pulse(PULSE)])
def test_formulas_of_scenes_are_the_pulse_and_its_integral(pulse: Pulse) -> None:
    t = np.linspace(0.0, 3.0 * PULSE, 3001) + 1e-9
    shape = Expression.parse(pulse.formula, ("t",))({"t": t})
    assert np.asarray(shape, dtype=float) == pytest.approx(pulse.value(t), abs=1e-12)
    integral = Expression.parse(pulse.integral_formula, ("t",))({"t": t})
    total = np.concatenate([[0.0], np.cumsum(0.5 * (shape[1:] + shape[:-1] * 1.0) * np.diff(t))])
    # Half an interval at the jump of the square pulse, and at the start.
    assert integral == pytest.approx(total, abs=1.1 * (t[1] - t[0]))
    assert first_rise(np.r_[-1e-9, t], np.r_[0.0, shape], 0.5) == pytest.approx(
        pulse.half_height, abs=1e-8
    )


def test_speeds_are_the_two_readings() -> None:
    assert STRAIN.speed == pytest.approx(5801.19, abs=0.005)
    assert PAPER.speed == pytest.approx(5000.0)
    for reading in READINGS:
        scene = WaveBar().scenes()[f"{reading.name}-smooth"]
        (body,) = Simulation.builder(scene).build().model.bodies
        assert body.material.wave_speed == pytest.approx(reading.speed)


def test_histories_find_what_is_known(tmp_path: Path) -> None:
    """The exact solution measured as if it were a run: no estimator has an error of its own."""
    case, path = WaveBar(particles=31), tmp_path / "any.h5"
    Simulation.builder(case.scenes()["uniaxial-strain-square"]).outputs(1).build().run(record=path)
    with Record(path) as record:
        times = np.linspace(0.0, 3.2 * LENGTH / C, 2001)
        X = np.linspace(0.0, LENGTH, 31)
        for pulse in case.pulses:
            exact = case.exact(STRAIN, pulse)
            histories = Histories(record, times, X, exact.stress(X, times[:, None]), exact)
            for station in (0.0, 0.05, 0.10, LENGTH):
                assert histories.overshoot(station) == pytest.approx(0.0, abs=1e-4)
                value, due = histories.peak(station)
                assert value == pytest.approx(due, rel=1e-4)
                if station:
                    arrival, due = histories.arrival(station)
                    assert arrival == pytest.approx(due, abs=times[1])
            assert histories.peak_of_passage(0.05, 2) == pytest.approx((100e3, 100e3), rel=1e-4)
            assert histories.peak_of_passage(0.05, 1) == pytest.approx((-100e3, -100e3), rel=1e-4)
        assert [histories.plateau(x)[0] for x in (0.0, 0.05, LENGTH)] == pytest.approx(
            [-100e3, -100e3, -200e3]
        )


# --- The case ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> CaseResult:
    return run_case(WaveBar(convergence=(121, 241)), tmp_path_factory.mktemp("wave"))


@pytest.mark.validation
def test_the_papers_resolution_keeps_within_every_bar(coarse: CaseResult) -> None:
    assert coarse.passed, [m for m in coarse.measurements if not m.passed]
    judged = [m for m in coarse.measurements if m.verdict.startswith("within")]
    # 3 of peaks, 1 of arrival and 5 of square pulses for each reading, and 2 of the moved end.
    assert len(judged) == 20


@pytest.mark.validation
def test_it_rings_and_viscosity_takes_that(coarse: CaseResult) -> None:
    overshoots = [m.value for m in coarse.measurements if "overshoot" in m.quantity]
    for bare, viscous in (overshoots[:2], overshoots[2:4]):
        # A jump at a loaded end particle, which little couples to others.
        assert bare > 0.8
        assert viscous < 0.75 * bare
    # What is left with viscosity is there alone.
    with Record(coarse.pictures[0].parent / "uniaxial-strain-square-viscous.h5") as record:
        stresses = record.field("cauchy_stress")
        first_passage = [
            np.asarray(stress)[1:, 0, 0]
            for time, stress in zip(record.times, stresses, strict=True)
            if time < LENGTH / C
        ]
    assert np.min(first_passage) > -1.1 * 100e3


@pytest.mark.validation
def test_pictures_and_tables_are_there(coarse: CaseResult) -> None:
    names = [picture.name for picture in coarse.pictures]
    assert names[0].startswith("fig-10-11-")
    assert names[1].startswith("fig-11-")
    for picture in coarse.pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.stat().st_size > 20_000
    assert len(coarse.tables) == 8
    columns = np.loadtxt(coarse.tables[0], delimiter=",", skiprows=1)
    assert columns.shape[1] == 9


def test_arrivals_are_on_time(tmp_path: Path) -> None:
    found = arrivals(tmp_path)
    assert found.passed
    assert found.verdict == "within 1 %"


def test_a_wrong_speed_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar four per cent heavier is two per cent slower: arrivals are told to one."""
    monkeypatch.setattr("solidsph_cases._bar.DENSITY", 1.04 * RHO)
    found = arrivals(tmp_path)
    assert not found.passed
    assert found.verdict == "NOT within 1 %"


def arrivals(folder: Path) -> Measurement:
    """The worst arrival of the smooth pulse, beside the exact one of the bar as it should be."""
    case, path = WaveBar(), folder / "bar.h5"
    Simulation.builder(case.scenes()["uniaxial-strain-smooth"]).build().run(record=path)
    with Record(path) as record:
        histories = Histories.of(record, case.exact(STRAIN, case.pulses[0]))
        return histories.worst("arrival", "s", 0.01, Histories.arrival, (0.05, 0.10, LENGTH))


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"particles": 60}, "60 particles leave none at 0.05"),
        ({"particles": 61.5}, "must be a whole number"),
        ({"convergence": (61, 120)}, "120 particles leave none"),
        ({"stress": 1e5}, "stress must be compressive"),
        ({"pulse": 0.0}, "pulse must be positive"),
        ({"pulse": 20e-6}, "take at most 1.724e-05 s"),
        ({"transits": 2.0}, "take at least 2.72"),
    ],
)
def test_a_wrong_parameter_is_one_clear_message(parameters: dict, expected: str) -> None:
    with pytest.raises(SceneError, match=expected):
        WaveBar(**parameters)


@pytest.mark.validation
def test_every_bar_holds_at_every_resolution_and_errors_fall(tmp_path: Path) -> None:
    case = WaveBar(convergence=(61, 121, 241, 481))
    for count in (61, 121, 241):
        one = attrs.evolve(case, particles=count, convergence=())
        outcome = run_case(one, tmp_path / str(count))
        for m in outcome.measurements:
            print(f"{count} particles: {m.quantity} = {m.value:.6g} {m.unit}, error {m.error}")
        assert outcome.passed, [m for m in outcome.measurements if not m.passed]
    outcome = run_case(case, tmp_path / "order")
    errors = [m.value for m in outcome.measurements if "root mean square" in m.quantity]
    assert np.all(np.diff(errors) < 0.0)
    # Second order but for the jump in the second derivative of sin^2, which allows 5/3.
    assert outcome.measurements[-1].value > 5.0 / 3.0
