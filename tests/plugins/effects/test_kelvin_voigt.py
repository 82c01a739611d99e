"""Kelvin-Voigt damping beside the decay of a standing wave and rigid motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from solidsph import Record, Simulation
from solidsph.run.energy import KINETIC, RESIDUAL, STRAIN
from solidsph.scene.scene_builder import SceneBuilder

RUBBER = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}
C = np.sqrt(1e6 * 0.7 / (1.3 * 0.4) / 1000.0)  # confined wave speed [m/s]


def bar(particles: int = 81) -> SceneBuilder:
    return (
        Simulation.builder()
        .body(
            "bar",
            shape={"type": "interval", "length": 1.0},
            spacing=1.0 / (particles - 1),
            discretisation="fitted",
        )
        .kernel("cubic-spline", cover=2.6)
        .formulation("total-lagrangian", gradient="consistent")
        .material("neo-hookean", **RUBBER)
        .boundary("clamp", where="left")
        .boundary("clamp", where="right")
        .initial(velocity={"x": "1e-4*sin(pi*X)"})
    )


def test_a_standing_wave_decays_by_half_of_time_times_frequency_squared() -> None:
    omega = np.pi * C
    tau = 0.1 / omega  # 5 % of critical damping
    simulation = bar().effect("kelvin-voigt", time=tau).duration(5 * np.pi / omega).outputs(200)
    made = simulation.build()
    X = made.particles.positions[:, 0]
    state, loop, found, times = made.start(), made.time_loop(), [], []
    for stop in made.output_steps():
        state = loop.advance(state, stop)
        found.append(2.0 / 80.0 * float((state.positions[:, 0] - X) @ np.sin(np.pi * X)))
        times.append(state.time)
    t = np.array(times)
    rate = 0.5 * tau * omega**2
    damped = np.sqrt(omega**2 - rate**2)
    expected = 1e-4 / damped * np.exp(-rate * t) * np.sin(damped * t)
    largest = np.abs(expected).max()
    # The ends and the spacing, a phase that grows over 2.5 periods, as without damping.
    assert np.abs(found - expected).max() < 6e-3 * largest
    undamped = 1e-4 / omega * np.sin(omega * t)
    assert np.abs(found - undamped).max() > 0.3 * largest  # a negative control


def test_what_it_takes_is_its_account_and_the_ledger_closes(tmp_path: Path) -> None:
    made = bar(41).effect("kelvin-voigt", time=2e-4).duration(0.05).outputs(50).build()
    made.run(record=tmp_path / "record.h5")
    with Record(tmp_path / "record.h5") as record:
        work = record.history["work of kelvin-voigt [J]"]
        play = (record.history[KINETIC] + record.history[STRAIN]).max()
        assert np.all(np.diff(work) <= 0.0)
        assert work[-1] < -0.1 * play
        assert np.abs(record.history[RESIDUAL]).max() < 1e-3 * play


def test_a_spin_is_not_damped() -> None:
    made = (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [1.0, 0.6]}, spacing=0.1)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", **RUBBER)
        .effect("kelvin-voigt", time=1e-3)
        .duration(1e-3)
        .build()
    )
    centre = np.array([0.5, 0.3])
    X = made.particles.positions - centre
    angle, rate = 0.7, 3.0
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x = X @ Q.T
    v = rate * np.column_stack([-x[:, 1], x[:, 0]])
    (load,) = made.dynamics.loads
    force = load.forces(0.0, centre + x, v)
    # Against that of a strain rate as large.
    stretching = load.forces(0.0, centre + x, rate * x)
    assert np.abs(force).max() < 1e-12 * np.abs(stretching).max()
