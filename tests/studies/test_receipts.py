"""Receipts: what an effect took, did and changed, against runs made by hand."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Scene, SceneError, Simulation
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.terms import Load
from solidsph.registry.construct import construct
from solidsph.run.outcome import FINISHED
from solidsph.studies.receipts import (
    LARGEST,
    Receipt,
    case_changes,
    measured_shares,
    quantity,
    receipts,
    reduced,
)
from solidsph.studies.variant import with_settings
from tests.commands.test_cli import solidsph

DAMPED = """
scheme = "corrected"
duration = 0.2
outputs = 10
[body.block]
shape = {type = "box", lengths = [1.0, 0.5]}
spacing = 0.05
[material]
type = "neo-hookean"
youngs_modulus = 1e5
poissons_ratio = 0.3
density = 1000.0
[[boundary]]
type = "clamp"
where = "left"
[[effect]]
type = "body-force"
acceleration = {y = -9.81}
label = "weight"
[[effect]]
type = "mass-damping"
rate = 5.0
label = "drag"
[[effect]]
type = "body-force"
acceleration = {x = 0.0}
label = "nothing"
"""

# A bar of 50 particles that meets a wall.
BLOW = """
scheme = "corrected"
duration = 4e-4
outputs = 10
[body.bar]
shape = {type = "interval", length = 1.0}
spacing = 0.02
[material]
type = "saint-venant-kirchhoff"
youngs_modulus = 200e9
poissons_ratio = 0.0
density = 8000.0
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {x = SPEED}
[[effect]]
type = "artificial-viscosity"
"""


def built(toml: str) -> Simulation:
    return Simulation.builder(Scene.from_toml(toml)).build()


@pytest.fixture(scope="module")
def of_block() -> Mapping[str, Receipt]:
    found = receipts(built(DAMPED), of=["tip=y@[1.0, 0.25]", "kinetic energy"])
    assert found.outcome == FINISHED
    assert found.coarser == 2.0
    assert found.particles == 50
    return {one.label: one for one in found.each}


def tips(toml: str, step: float) -> np.ndarray:
    """Displacement of the particle nearest to the tip, over ten outputs; by the loop itself."""
    scene = Scene.from_toml(toml.replace("spacing = 0.05", "spacing = 0.1"))
    simulation = Simulation.builder(attrs.evolve(scene, engine="matrix")).build()
    dynamics = attrs.evolve(simulation.dynamics, step_size=step)
    loop, state = attrs.evolve(simulation, dynamics=dynamics).time_loop(), simulation.start()
    X = simulation.particles.positions
    nearest = int(np.argmin(np.hypot(X[:, 0] - 1.0, X[:, 1] - 0.25)))
    found = [state.positions[nearest, 1] - X[nearest, 1]]
    steps = round(scene.duration / step)
    for stop in np.rint(np.linspace(0, steps, 11)[1:]).astype(int):
        state = loop.advance(state, int(stop))
        found.append(state.positions[nearest, 1] - X[nearest, 1])
    return np.array(found)


def test_the_change_is_that_of_two_runs_made_by_hand(of_block: Mapping[str, Receipt]) -> None:
    step = Simulation.builder(reduced(Scene.from_toml(DAMPED))).build().step_size
    dragged = tips(DAMPED, step)
    free = tips(DAMPED.replace("rate = 5.0", "rate = 1e-99"), step)
    change = np.abs(dragged - free).max() / np.abs(dragged).max()
    assert change > 0.05
    # The same steps of the same particles, but for a drag of 1e-99 and the order of sums.
    assert of_block["drag"].changes["tip=y@[1.0, 0.25]"] == pytest.approx(change, rel=1e-9)


def test_without_the_weight_nothing_moves(of_block: Mapping[str, Receipt]) -> None:
    weight = of_block["weight"]
    assert weight.changes[LARGEST] == 1.0
    assert weight.changes["kinetic energy"] == weight.changes["kinetic energy [J]"] == 1.0
    assert weight.work is not None
    assert weight.work > 0.0 > (of_block["drag"].work or 0.0)
    assert "changed the tip by 100 %" in weight.line


def test_what_does_nothing_never_acted(of_block: Mapping[str, Receipt]) -> None:
    assert not of_block["nothing"].acted
    assert of_block["nothing"].line.endswith("never acted")
    assert of_block["drag"].acted


class Clock:
    """A clock that stands still but for what an effect takes."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@attrs.frozen
class Busy(Effect):
    """Takes its time, by the clock that it is given, and does nothing."""

    clock: Clock
    seconds: float

    def bind(self, model: Any, label: str) -> Load:
        return BusyForce(label, np.arange(1), self.clock, self.seconds)


@attrs.frozen(eq=False)
class BusyForce(Load):
    label: str
    particles: Any
    clock: Clock
    seconds: float

    def forces(self, time: float, positions: Any, velocities: Any) -> Any:
        self.clock.now += self.seconds
        return np.zeros((1, positions.shape[1]))

    def report(self, observation: Any) -> Mapping[str, float]:
        return {}


def test_time_is_what_steps_take_more() -> None:
    """Of steps that take a second besides, one that takes three has three quarters of the time."""
    clock = Clock()
    builder = Simulation.builder(Scene.from_toml(DAMPED))
    builder.effect(Busy(clock, 1.0), label="rest").effect(Busy(clock, 3.0), label="busy")
    found = measured_shares(builder.build(), ticks=clock)
    # Of rounding alone.
    assert found["busy"] == pytest.approx(0.75, rel=1e-12)
    assert found["rest"] == pytest.approx(0.25, rel=1e-12)
    assert found["drag"] == pytest.approx(0.0, abs=1e-12)


def test_what_a_run_fails_without_is_needed() -> None:
    """This law softens in compression: shocks of 0.26 c and more turn particles inside out.

    From 0.3 c on they do so with viscosity too.
    """
    speed = -0.28 * (200e9 / 8000.0) ** 0.5
    (one,) = receipts(built(BLOW.replace("SPEED", f"{speed}"))).each
    assert one.outcome.startswith("diverges at t = ")
    assert "needed: without it the run diverges" in one.line
    (one,) = receipts(built(BLOW.replace("SPEED", f"{0.1 * speed}"))).each
    assert one.outcome == FINISHED


def test_reduced_is_coarser_and_not_too_long() -> None:
    scene = Scene.from_toml(DAMPED)
    assert reduced(scene).bodies["block"].spacing == 0.1
    # Three particles across are kept.
    assert reduced(scene, 100.0).bodies["block"].spacing == pytest.approx(0.5 / 3.0)
    long = reduced(attrs.evolve(scene, duration=1e4))
    assert 0.0 < long.duration < 1e4
    assert long.outputs < scene.outputs


@pytest.mark.parametrize("wrong", ["tip=w@[1.0]", "tip=x@[]", "x@[1.0]", "tip=x@[a]"])
def test_a_quantity_that_is_none(wrong: str) -> None:
    with pytest.raises(SceneError, match=r"write NAME=x@\[0.35, 0.01\]"):
        quantity(wrong)


def test_a_column_that_is_none() -> None:
    with pytest.raises(SceneError, match=r"no column 'knetic'.*kinetic energy"):
        receipts(built(DAMPED), of=["knetic"])


def test_what_a_case_measures_changes_without_it() -> None:
    strip = construct("cases", {"type": "thin-strip", "across": 3, "along": 11})
    case = with_settings(strip, {"hourglass": 0.5})
    (changes,) = case_changes(case).values()
    assert changes
    assert all(0.0 <= change < np.inf for change in changes.values())


def test_run_shows_receipts(tmp_path: Path) -> None:
    (tmp_path / "block.toml").write_text(DAMPED)
    done = solidsph("run", "block.toml", "--receipts", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)["receipts"]
    assert [one["label"] for one in facts["each"]] == ["weight", "drag", "nothing"]
    assert facts["each"][0]["changes"][LARGEST] == 1.0
    done = solidsph("run", "block.toml", "--receipts-of", "kinetic energy", cwd=tmp_path)
    assert done.returncode == 2
    assert "add --receipts" in done.stderr
