"""The step is cut where bodies grow stiffer, and a resumed run takes the same steps."""

from __future__ import annotations

from math import inf
from pathlib import Path

import attrs
import numpy as np
import pytest

from solidsph import DivergedError, Record, Simulation, resume
from solidsph.results import checkpointer
from solidsph.run import step_follower
from solidsph.run.safe_step import safe_step
from solidsph.run.step_follower import StepFollower, restarted
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.resuming import OFTEN, Stop, assert_same_record
from tests.helpers.scenes import SOFT, box

ON_SURFACE = "conforming-lattice"


def pulled_sheet(
    cells: int, duration: float, outputs: int, time_step_factor: float = 0.95
) -> SceneBuilder:
    """A quarter of a sheet of rubber with a hole, pulled suddenly by half its modulus.

    Close to the critical step by default, so that what the sheet gains in stiffness is too much;
    and without a filter of its dilatation, with which it gains less.
    """
    hole = {"type": "disc", "radius": 0.2, "centre": [0.0, 0.0]}
    whole = {"type": "box", "lengths": [1.0, 1.0]}
    return (
        Simulation.builder()
        .body(
            "sheet",
            shape={"type": "difference", "of": whole, "minus": hole},
            spacing=1.0 / cells,
            discretisation={"type": "fitted-moments", "of": ON_SURFACE},
        )
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", youngs_modulus=1e7, poissons_ratio=0.49, density=1000.0)
        .formulation("total-lagrangian", gradient="consistent", filter_above=inf)
        .boundary("symmetry", axis="x")
        .boundary("symmetry", axis="y")
        .boundary("traction", where="right", traction={"x": 5e6})
        .integrator("velocity-verlet", time_step_factor=time_step_factor)
        .duration(duration)
        .outputs(outputs)
    )


@pytest.fixture(scope="module")
def sheet() -> Simulation:
    return pulled_sheet(8, 4e-3, 20).build()


def test_a_body_that_grows_stiffer_gets_a_shorter_step(sheet: Simulation) -> None:
    result = sheet.run()
    (note,) = result.notes
    assert "the step was cut" in note
    assert result.effort["step size [s]"] == 0.5 * sheet.step_size
    # Some steps were made before the cut, and count twice.
    assert result.state.step == 2 * sheet.steps
    assert result.state.time == pytest.approx(sheet.scene.duration, rel=1e-12)


def test_the_step_stays_below_the_critical_one(sheet: Simulation) -> None:
    parts = []

    class Measured:
        @step_follower.implementation
        def solidsph_step_end(self, simulation, observation) -> None:
            safe = safe_step(simulation.dynamics, simulation.integrator, observation.state)
            parts.append(simulation.step_size / safe.step)

    sheet.run(observers=[Measured()])
    assert max(parts) < 1.0


def test_without_it_the_run_diverges(monkeypatch: pytest.MonkeyPatch) -> None:
    def keep(self, simulation, state, observation):
        return simulation, state

    monkeypatch.setattr(StepFollower, "followed", keep)
    longer = pulled_sheet(8, 2e-2, 100).build()
    with pytest.raises(DivergedError):
        longer.run()


@pytest.mark.parametrize("engine", ["matrix", "compiled"])
def test_a_resumed_run_is_cut_as_one_without_a_break(
    engine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpointer, "SHARE", OFTEN)
    monkeypatch.setattr(step_follower, "_CHECKED", 7)  # between outputs as well
    simulation = pulled_sheet(8, 4e-3, 8).engine(engine).build()
    whole = tmp_path / "whole.h5"
    result = simulation.run(record=whole)
    assert result.notes
    for output in range(1, 8):
        path = tmp_path / f"{output}.h5"
        with pytest.raises(KeyboardInterrupt):
            simulation.run(record=path, observers=[Stop(output)])
        again = resume(path, simulation=simulation)
        assert np.array_equal(again.state.positions, result.state.positions)
        assert again.state.step == result.state.step
        assert_same_record(whole, path)


def test_a_finished_run_that_was_cut_is_extended(sheet: Simulation, tmp_path: Path) -> None:
    path = tmp_path / "sheet.h5"
    first = sheet.run(record=path)
    assert first.notes
    longer = resume(path, until=1.25 * sheet.scene.duration)
    assert longer.state.time == pytest.approx(1.25 * sheet.scene.duration, rel=0.01)
    assert longer.effort["step size [s]"] <= 0.5 * sheet.step_size
    with Record(path) as record:
        assert record.outcome == "finished"
        assert np.all(np.diff(record.times) > 0.0)


def test_a_soft_body_that_swings_keeps_its_step_at_little_cost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    evaluations = 0
    looked = step_follower.safe_step

    def counted(*args, **kwargs):
        nonlocal evaluations
        evaluations += 1
        return looked(*args, **kwargs)

    monkeypatch.setattr(step_follower, "safe_step", counted)
    simulation = (
        box(2, 8)
        .boundary("clamp", where="left")
        .effect("hourglass-control")
        .initial(velocity={"y": "2*X**2"})
        .duration(1.0)
        .outputs(50)
        .build()
    )
    result = simulation.run()
    assert not result.notes
    # A look takes 30 evaluations at most, and most take 6.
    assert evaluations * 12 < 0.05 * simulation.steps


def test_a_step_that_is_too_long_from_the_start_stays_so() -> None:
    """It is not cut behind the back of whoever has made it so."""
    simulation = box(2, 6).initial(velocity={"x": "1e-3*X"}).build()
    assert simulation.safe is not None
    dynamics = attrs.evolve(simulation.dynamics, step_size=0.99 * simulation.safe.step)
    steps = int(simulation.scene.duration / dynamics.step_size)
    fixed = attrs.evolve(simulation, dynamics=dynamics, steps=steps)
    assert not fixed.run().notes


def test_the_ledger_of_a_run_that_was_cut_adds_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """What swings with the fastest vibrations is a sixth of the energy, and falls to a quarter."""
    looked = step_follower.safe_step

    def halved_in_the_middle(dynamics, integrator, state, near=None):
        safe = looked(dynamics, integrator, state, near)
        return attrs.evolve(safe, step=0.6 * safe.step) if state.time > 0.1 else safe

    monkeypatch.setattr(step_follower, "safe_step", halved_in_the_middle)
    monkeypatch.setattr(step_follower, "_MOST_STEPS", 10)
    simulation = (
        box(2, 8)
        .kernel("cubic-spline", cover=2.6)
        .material("linear-elastic", **SOFT)
        .formulation("total-lagrangian", gradient="consistent")
        .duration(0.2)
        .build()
    )
    velocities = np.random.default_rng(0).normal(size=simulation.initial.velocities.shape)
    initial = attrs.evolve(simulation.initial, velocities=1e-3 * velocities)
    result = attrs.evolve(simulation, initial=initial).run()  # else UnsoundError
    assert len(result.notes) == 1


@pytest.mark.validation
@pytest.mark.parametrize(
    ("cells", "factor"),
    [
        pytest.param(
            *(16, 0.95),
            marks=pytest.mark.xfail(
                strict=True,
                raises=DivergedError,
                reason="it is cut only beyond 0.95 of the critical step, and a look comes too late",
            ),
        ),
        (16, 0.85),
        (32, 0.7),
        (40, 0.7),
    ],
)
def test_a_suddenly_pulled_sheet_is_sound(cells: int, factor: float) -> None:
    """It stretches by half, swings, and its critical step falls to a third or less."""
    result = pulled_sheet(cells, 0.1, 200, factor).build().run()
    assert result.notes


def test_what_fails_between_two_looks_is_repeated_with_half_the_step(tmp_path: Path) -> None:
    """The front stiffens it more in an output than the step can bear."""
    record = tmp_path / "sheet.h5"
    result = pulled_sheet(48, 8e-3, 16, 0.7).build().run(record=record)  # else DivergedError
    (note,) = result.notes
    assert "with a longer one the acceleration is not finite" in note
    with Record(record) as whole:
        assert len(whole.times) == 17
        assert np.all(np.diff(whole.times) > 0.0)


def test_what_half_the_step_does_not_mend_is_given_up(sheet: Simulation) -> None:
    below = pulled_sheet(8, 4e-3, 20, 0.7).build()
    follower, simulation, state = StepFollower(below), below, below.start()
    for halvings in (1, 2, 3):
        found = follower.repeated(simulation, state, "it failed")
        assert found is not None
        simulation, state = found
        assert simulation.halvings == halvings
    assert follower.repeated(simulation, state, "it failed") is None
    # A scene that asks for a longer step than is safe gets it, and what comes of it.
    assert StepFollower(sheet).repeated(sheet, sheet.start(), "it failed") is None


METAL = {**SOFT, "type": "j2-plasticity", "yield_stress": 1e4}
FLOOR = {"point": {"x": 0.0}, "normal": {"x": 1.0}, "friction": 0.5}
HOT = {"conductivity": 5e4, "heat_capacity": 500.0, "initial": "10*sin(4*X)"}


@pytest.mark.parametrize(
    ("builder", "name"),
    [
        (box(2).material(METAL), "history of block"),
        (box(2).effect("rigid-wall", **FLOOR, label="wall"), "wall slip"),
        (box(2).effect("heat", **HOT, label="heat"), "heat: temperature"),
    ],
)
def test_a_cut_forgets_nothing(builder: SceneBuilder, name: str) -> None:
    """Metal that had yielded was as new after a cut: a copper block lost 10 % of its energy."""
    simulation = builder.initial(velocity={"x": "-2", "y": "2*X"}).duration(0.02).build()
    state = simulation.time_loop().advance(simulation.start(), simulation.steps)
    after = restarted(simulation.halved(), state, 0)
    start = simulation.start().memory[name]
    assert np.abs(state.memory[name] - start).max() > 1e-3 * max(1.0, np.abs(start).max())
    assert np.array_equal(after.memory[name], state.memory[name])
    # The same sums, by another engine perhaps; nothing here depends on velocities or the step.
    largest = np.abs(state.accelerations).max()
    assert np.abs(after.accelerations - state.accelerations).max() < 1e-9 * largest
