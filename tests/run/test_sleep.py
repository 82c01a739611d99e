"""Regions that nothing has reached cost nothing, and change nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.special import erf

from solidsph import Scene, Simulation, resume
from solidsph.errors import BuildError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.results import checkpointer
from solidsph.run.sleeping.slabs import Slabs
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.resuming import OFTEN, Stop

UNIT = {"youngs_modulus": 1.0, "poissons_ratio": 0.0, "density": 1.0}  # a wave speed of 1
LENGTH, WIDTH = 10.0, 0.1  # of the bar, and of the pulse's standard deviation [m]


def bar(particles: int = 1500) -> SceneBuilder:
    return (
        Simulation.builder()
        .scheme("corrected")
        .body("bar", shape={"type": "interval", "length": LENGTH}, spacing=LENGTH / particles)
        .kernel("cubic-spline", cover=2.6)
        .material("linear-elastic", **UNIT)
        .engine("matrix")
        .duration(8.0)
        .outputs(8)
    )


def pulse(builder: SceneBuilder) -> SceneBuilder:
    """A pulse, 1 m long to 4e-6 of its peak, that runs to the right and leaves nothing behind.

    The velocity belongs to the discrete wave: v = -c G u sqrt(1 + (c dt G / 2)^2), by its series,
    G being the discrete gradient and dt the step. Only then is no wave sent back.
    """
    made = builder.build()
    X, dt = made.particles.positions[:, 0], made.step_size
    u = 0.005 * (1.0 - erf((X - 1.0) / (WIDTH * np.sqrt(2.0))))

    def gradient(field: Array) -> Array:
        return made.dynamics.internal.gradients(field[:, None])[:, 0, 0]

    first = gradient(u)
    third = gradient(gradient(first))
    fifth = gradient(gradient(third))
    v = -(first + dt**2 / 8.0 * third - dt**4 / 128.0 * fifth)
    return Simulation.builder(made.scene).initial(
        displacement={"x": lambda X, t: u}, velocity={"x": lambda X, t: v}
    )


def worst(one: State, other: State, X: Array) -> float:
    """Largest differences of displacement and velocity, of the peaks."""
    return max(
        np.abs(one.positions - other.positions).max() / np.abs(one.positions - X).max(),
        np.abs(one.velocities - other.velocities).max() / np.abs(one.velocities).max(),
    )


def test_a_pulse_costs_what_it_takes_itself() -> None:
    """On a bar ten pulse lengths long: a fifth of the work at most, the same answer to 1e-9."""
    full = pulse(bar()).build()
    asleep = pulse(bar()).sleep().build()
    one, other = full.run(), asleep.run()
    # Of all evaluations of all particles; measured 0.187.
    assert other.effort["awake [-]"] < 0.2
    assert worst(one.state, other.state, full.particles.positions) < 1e-9
    assert "awake [-]" not in one.effort
    # It has crossed most of the bar, and nothing is left where it was.
    v = np.abs(other.state.velocities[:, 0])
    X = full.particles.positions[:, 0]
    assert X[np.argmax(v)] == pytest.approx(9.0, abs=0.05)
    assert v[X < 7.0].max() < 1e-8 * v.max()


@pytest.mark.validation  # it compiles twice
def test_the_compiled_engine_lets_the_same_regions_sleep() -> None:
    runs = [pulse(bar(600)).engine(name).sleep().build().run() for name in ("matrix", "compiled")]
    awake = [run.effort["awake [-]"] for run in runs]
    assert awake[0] == pytest.approx(awake[1], abs=0.01)  # rounding may wake a slab
    assert awake[0] < 0.6
    x = [run.state.positions for run in runs]
    assert np.abs(x[0] - x[1]).max() < 1e-11  # rounding of positions up to 10


def strip(engine: str = "matrix") -> SceneBuilder:
    """A strip whose left end is pushed, with loads of every kind that can sleep."""
    return (
        Simulation.builder()
        .scheme("corrected")  # rows of particles that slabs can count
        .body("strip", shape={"type": "box", "lengths": [4.0, 0.3]}, spacing=0.05)
        .kernel("cubic-spline", cover=1.8)
        .material("neo-hookean", **UNIT)
        .boundary("prescribed-motion", where="left", displacement={"x": "0.01*sin(pi*min(t,1))**2"})
        .boundary("clamp", where="right")
        .effect("artificial-viscosity")
        .effect("mass-damping", rate=0.5)
        .engine(engine)
        .duration(2.5)
        .outputs(5)
    )


@pytest.mark.parametrize(
    "engine", ["matrix", pytest.param("compiled", marks=pytest.mark.validation)]
)
def test_motions_and_loads_act_on_what_is_awake(engine: str) -> None:
    full, asleep = strip(engine).build(), strip(engine).sleep(slabs=40).build()
    one, other = full.run(), asleep.run()
    assert other.effort["awake [-]"] < 0.85
    assert worst(one.state, other.state, full.particles.positions) < 1e-9
    assert one.state.work.keys() == other.state.work.keys()
    for name, work in one.state.work.items():
        assert other.state.work[name] == pytest.approx(work, rel=1e-7, abs=1e-15)
    again = strip(engine).sleep(slabs=40).build().run()
    assert np.array_equal(other.state.positions, again.state.positions)


@pytest.mark.parametrize(
    "engine", ["matrix", pytest.param("compiled", marks=pytest.mark.validation)]
)
def test_hourglass_control_acts_on_what_is_awake(engine: str) -> None:
    scene = strip(engine).effect("hourglass-control").scene()
    full, asleep = (
        Simulation.builder(scene).build(),
        Simulation.builder(scene).sleep(slabs=40).build(),
    )
    one, other = full.run(), asleep.run()
    assert other.effort["awake [-]"] < 0.95
    assert worst(one.state, other.state, full.particles.positions) < 1e-9
    without = strip(engine).build().run().state
    assert worst(one.state, without, full.particles.positions) > 1e-4  # or else nothing is tested


def test_what_changes_far_away_wakes_what_it_acts_on() -> None:
    """A load at the right end that comes late, while the pulse is at the left."""
    scene = strip().effect("body-force", where="X > 3.5", acceleration={"y": "0.01*(t > 1)"})
    full = scene.build()
    asleep = Simulation.builder(full.scene).sleep(slabs=40).build()
    one, other = full.run().state, asleep.run().state
    right = full.particles.positions[:, 0] > 3.6
    assert np.abs(one.velocities[right]).max() > 1e-4
    assert worst(one, other, full.particles.positions) < 1e-9


def test_all_awake_is_the_same_run() -> None:
    full, asleep = strip().build(), strip().sleep(slabs=2).build()
    one, other = full.run(), asleep.run()
    assert other.effort["awake [-]"] == 1.0
    assert np.abs(one.state.positions - other.state.positions).max() < 1e-14


def test_a_sleeping_run_goes_on_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpointer, "SHARE", OFTEN)
    whole = strip().sleep(slabs=40).build().run(record=tmp_path / "whole.h5").state
    with pytest.raises(KeyboardInterrupt):
        strip().sleep(slabs=40).build().run(record=tmp_path / "half.h5", observers=[Stop(4)])
    again = resume(tmp_path / "half.h5").state
    assert np.array_equal(whole.positions, again.positions)
    assert np.array_equal(whole.velocities, again.velocities)


def test_the_words_of_a_scene() -> None:
    scene = strip().sleep(tolerance=1e-8, slabs=30).scene()
    again = Scene.from_toml(scene.to_toml())
    assert again.sleep == scene.sleep
    assert Scene.from_toml(strip().scene().to_toml()).sleep is None


def test_slabs_cut_the_longest_side_and_hold_some_rows() -> None:
    particles = strip().build().particles
    slabs = Slabs.across(particles, 1000)
    assert slabs.count == 20  # 80 rows, four of which go into each
    assert np.ptp([particles.positions[slabs.of == k, 0].mean() for k in range(20)]) > 3.5
    one = np.zeros(20, dtype=bool)
    one[7] = True
    assert np.flatnonzero(slabs.widened(one, slabs.width)).tolist() == [6, 7, 8]
    assert np.flatnonzero(slabs.widened(one, 1.5 * slabs.width)).tolist() == [5, 6, 7, 8, 9]


@pytest.mark.parametrize(
    ("builder", "said"),
    [
        (strip().effect("kelvin-voigt", time=1e-3), "restricted to awake particles"),
        (bar(100).formulation("updated-lagrangian"), "cannot form the forces of some"),
        (
            strip().material("viscoelastic", **UNIT, prony=[{"share": 0.5, "time": 1.0}]),
            "cannot form the forces of some",
        ),
        (Simulation.builder(strip().scene()).sleep(tolerance=2.0), "between 0 and 1"),
        (Simulation.builder(strip().scene()).sleep(slabs=1), "of at least 2"),
    ],
)
def test_what_cannot_sleep_is_refused(builder: SceneBuilder, said: str) -> None:
    scene = builder.scene()
    wanted = builder if scene.sleep is not None else builder.sleep()
    with pytest.raises(BuildError, match=said):
        wanted.build()
