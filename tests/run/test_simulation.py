"""The time loop: reproducible, observed where it says, stopped where it must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from solidsph import DivergedError, Record, Scene, SceneError, Simulation
from solidsph.run.energy import kinetic_energy, strain_energy
from solidsph.run.hooks import implementation
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import SCENE_TOML, SOFT, box


class Steps:
    """Remembers the steps at which it was called."""

    def __init__(self) -> None:
        self.steps: list[int] = []

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self.steps.append(observation.state.step)


def test_the_same_scene_gives_the_same_bits() -> None:
    first, second = (
        Simulation.builder(Scene.from_toml(SCENE_TOML)).build().run().state for _ in range(2)
    )
    assert np.array_equal(first.positions, second.positions)
    assert np.array_equal(first.velocities, second.velocities)


def test_a_simulation_can_be_run_again() -> None:
    simulation = box(2).initial(velocity={"x": "sin(3*Y)"}).build()
    first, second = simulation.run().state, simulation.run().state
    assert first.time == second.time == pytest.approx(1e-2)
    assert np.array_equal(first.positions, second.positions)


def test_outputs_are_evenly_spread_and_the_last_is_the_end() -> None:
    simulation = box(1).outputs(4).build()
    steps = Steps()
    simulation.run(observers=[steps])
    assert steps.steps == [0, *simulation.output_steps()]
    assert steps.steps[-1] == simulation.steps
    assert len(steps.steps) == 5


def test_more_outputs_than_steps_record_every_step() -> None:
    simulation = box(1).outputs(10**6).build()
    assert simulation.output_steps() == tuple(range(1, simulation.steps + 1))


def test_the_step_follows_the_confined_wave_speed() -> None:
    simulation = box(1, 10).integrator("velocity-verlet", time_step_factor=0.5).build()
    mu = 1e6 / 2.6
    lam = 2.0 * mu * 0.3 / 0.4
    confined = np.sqrt((lam + 2.0 * mu) / 1000.0)
    assert simulation.step_size <= 0.5 * 0.1 / confined
    assert simulation.step_size > 0.45 * 0.1 / confined  # rounded to a whole number of steps


def test_damping_shortens_the_step() -> None:
    free = box(1).build().step_size
    damped = box(1).effect("mass-damping", rate=1e4).build().step_size
    assert damped < 0.5 * free


def residual_of_a_shaken_block(path: Path, time_step_factor: float) -> float:
    """Largest energy residual over the largest energy, with loads, damping and gravity."""
    simulation = (
        box(2)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": "-2e4*sin(300*t)"})
        .effect("body-force", acceleration={"y": -9.81})
        .effect("mass-damping", rate=20.0)
        .duration(0.05)
        .integrator("velocity-verlet", time_step_factor=time_step_factor)
        .build()
    )
    simulation.run(record=path)
    with Record(path) as record:
        history = record.history
        work = sum(values for name, values in history.items() if name.startswith("work of"))
        total = history["kinetic energy [J]"] + history["strain energy [J]"]
        assert history["work of mass-damping [J]"][-1] < 0.0
        residual = history["energy residual [J]"]
        assert residual == pytest.approx(total - total[0] - work, abs=1e-9)
        return float(np.abs(residual).max() / total.max())


def test_energy_accounts_close_with_the_square_of_the_step(tmp_path: Path) -> None:
    coarse = residual_of_a_shaken_block(tmp_path / "coarse.h5", 0.2)
    fine = residual_of_a_shaken_block(tmp_path / "fine.h5", 0.1)
    assert fine < 2e-3
    # Four, up to the next order of the step.
    assert coarse / fine == pytest.approx(4.0, rel=0.1)


def test_what_a_penalty_stores_is_what_its_account_has_taken(tmp_path: Path) -> None:
    """Its force is linear in the displacements, so the trapezoidal rule is exact for its work."""
    simulation = (
        box(2)
        .effect("hourglass-control")
        .boundary("clamp", where="left")
        .initial(displacement={"x": "0.02*sin(9*Y)"}, velocity={"x": "3*sin(2*X)"})
        .duration(0.02)
        .outputs(20)
        .build()
    )
    simulation.run(record=tmp_path / "run.h5")
    with Record(tmp_path / "run.h5") as record:
        stored = record.history["hourglass-control energy [J]"]
        work = record.history["work of hourglass-control [J]"]
        assert np.ptp(stored) > 0.1 * stored.max() > 0.0
        # Rounding of some hundred steps.
        np.testing.assert_allclose(stored + work, stored[0], rtol=1e-11)


def test_energies_of_every_body_add_up(tmp_path: Path) -> None:
    """Two bodies that do not touch: each keeps the energy that it has, in its own column."""

    def body(builder: SceneBuilder, name: str, at: float) -> SceneBuilder:
        shape = {"type": "box", "lengths": [1.0, 1.0], "origin": [at, 0.0]}
        return builder.body(name, shape=shape, spacing=1 / 6)

    simulation = (
        body(body(Simulation.builder(), "quick", 0.0), "slow", 3.0)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", **SOFT)
        .effect("hourglass-control")
        .initial(where="quick", velocity={"x": "sin(pi*X)"})
        .initial(where="slow", velocity={"x": "0.3*sin(pi*(X - 3))"})
        .duration(0.02)
        .outputs(10)
        .integrator("velocity-verlet", time_step_factor=0.2)
        .build()
    )
    simulation.run(record=tmp_path / "run.h5")
    with Record(tmp_path / "run.h5") as record:
        history = record.history
        for kind in ("kinetic", "strain", "hourglass-control"):
            parts = [history[f"{kind} energy of {name} [J]"] for name in ("quick", "slow")]
            np.testing.assert_allclose(sum(parts), history[f"{kind} energy [J]"], rtol=1e-12)
            assert max(parts[0]) > max(parts[1]) > 0.0
        for name in ("quick", "slow"):
            own = sum(
                history[f"{kind} energy of {name} [J]"]
                for kind in ("kinetic", "strain", "hourglass-control")
            )
            # Nothing acts on either; the scheme's energy wavers by (w dt)^2 / 8, some 1e-3.
            np.testing.assert_allclose(own, own[0], rtol=3e-3)


def test_mass_damping_decays_as_the_closed_form_says() -> None:
    """A rigid body's velocity under f = -c m v is v0 exp(-c t); the error falls as step^2."""

    def error(time_step_factor: float) -> float:
        simulation = (
            box(1)
            .initial(velocity={"x": 2.0})
            .effect("mass-damping", rate=50.0)
            .integrator("velocity-verlet", time_step_factor=time_step_factor)
            .duration(0.04)
            .build()
        )
        velocities = simulation.run().state.velocities[:, 0]
        assert np.ptp(velocities) < 1e-12
        return abs(velocities[0] / (2.0 * np.exp(-2.0)) - 1.0)

    assert error(0.05) < 1e-4
    assert error(0.1) / error(0.05) == pytest.approx(4.0, rel=0.2)


def test_free_fall() -> None:
    simulation = box(3, 4).effect("body-force", acceleration={"z": -9.81}).duration(0.1).build()
    state = simulation.run().state
    fallen = state.positions - simulation.particles.positions
    # Constant acceleration is integrated exactly; rounding alone remains.
    assert fallen[:, 2] == pytest.approx(-0.5 * 9.81 * 0.01, rel=1e-12)
    assert np.abs(fallen[:, :2]).max() < 1e-15


def diverging() -> Simulation:
    """Crushed by a wall faster than sound: the volume of the first particles turns over."""
    return (
        box(1, 20)
        .boundary("prescribed-motion", where="left", displacement={"x": "200*t"})
        .boundary("clamp", where="right")
        .duration(0.05)
        .outputs(50)
        .build()
    )


def test_a_diverging_run_stops_with_the_facts_and_keeps_its_record(tmp_path) -> None:
    path = tmp_path / "record.h5"
    simulation = diverging()
    with pytest.raises(DivergedError) as caught:
        simulation.run(record=path)
    error = caught.value
    assert 0 < error.step < simulation.steps
    assert error.time == pytest.approx(error.step * simulation.step_size)
    assert 0 <= error.particle < 20
    assert not error.volume_ratio > 0.0
    for fact in (f"step {error.step}", f"particle {error.particle}", "J = ", "time_step_factor"):
        assert fact in str(error)
    with Record(path) as record:
        assert record.outcome.startswith("diverged")
        assert len(record.times) >= 1
        assert record.times[-1] < error.time
        assert np.isfinite(record.positions[-1]).all()


def test_a_diverged_error_survives_pickling() -> None:
    import pickle

    error = DivergedError(step=3, time=1.0, particle=7, volume_ratio=-0.5, cause="it burst")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert again.particle == 7


def test_updated_and_total_lagrangian_agree_on_a_small_smooth_motion() -> None:
    """The two forms discretise one equation; at strain 1e-5 they differ at that order."""

    def moved(form: str) -> np.ndarray:
        simulation = (
            Simulation.builder()
            .scheme("corrected")  # a gradient that both forms have
            .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.02)
            .kernel("modified-mollifier", cover=3.5)
            .material("neo-hookean", **SOFT)
            .formulation(form)
            .initial(velocity={"x": "1e-3*sin(2*pi*X)"})
            .duration(5e-3)
            .build()
        )
        return simulation.run().state.positions - simulation.particles.positions

    total, updated = moved("total-lagrangian"), moved("updated-lagrangian")
    scale = np.abs(total).max()
    assert scale > 1e-7
    assert np.abs(total - updated).max() < 1e-3 * scale


def test_a_wave_keeps_its_energy() -> None:
    simulation = (
        box(2, 10).initial(velocity={"x": "sin(pi*X)", "y": "0.5*cos(pi*X)"}).duration(0.1).build()
    )
    start = simulation.dynamics.observe(simulation.start())
    end = simulation.dynamics.observe(simulation.run().state)
    before = kinetic_energy(start) + strain_energy(start)
    after = kinetic_energy(end) + strain_energy(end)
    assert strain_energy(end) > 0.05 * before
    # Symplectic scheme at half the stable step: the energy wavers by (w dt)^2 / 8 at most.
    assert after == pytest.approx(before, rel=1e-2)


def test_a_tag_of_the_scene_is_known_to_its_handlers() -> None:
    simulation = (
        box(2, tags={"corner": "X < 0.2 and Y < 0.2"}).boundary("clamp", where="corner").build()
    )
    assert simulation.particles.tags["corner"].sum() == 1
    with pytest.raises(SceneError, match="no tag 'edge'"):
        simulation.particles.tagged("edge")
