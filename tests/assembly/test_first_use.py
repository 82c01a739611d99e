"""What a part that is not our own is asked when a scene first uses it: lies are told of, and what
is honest is used without a word."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Effect
from solidsph.errors import BuildError, PartWarning, PluginError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import EnergyTerm, Load, Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_builtin.materials.neo_hookean import NeoHookean
from tests.helpers.scenes import SOFT, box

K = 1e3  # [N/m]


class OnAll(Load):
    """A force on every particle, of which subclasses say what it is."""

    stiffness = 0.0

    def __init__(self, label: str, model: DiscreteModel) -> None:
        self._label = label
        self.X, self.masses = model.particles.positions, model.masses

    @property
    def label(self) -> str:
        return self._label

    @property
    def particles(self) -> Indices:
        return np.arange(len(self.X))

    @property
    def stiffness_rate(self) -> float:
        return float(np.sqrt(self.stiffness / self.masses.min()))

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


class Floor(OnAll, EnergyTerm):
    """Pushes what is below the lowest particles at rest: each of those just touches it."""

    stiffness = K

    def depth(self, positions: Array) -> Array:
        return np.maximum(self.X[:, 1].min() - positions[:, 1], 0.0)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return K * self.depth(positions)[:, None] * np.array([0.0, 1.0])

    def energies(self, observation: Observation) -> Array:
        return np.asarray(0.5 * K * self.depth(observation.state.positions) ** 2)


class Hertzian(OnAll, EnergyTerm):
    """Springs whose force is a power of the extension, so that at rest they have no stiffness."""

    power = 3.0

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        u = positions - self.X
        return np.asarray(-K * np.sign(u) * np.abs(1e2 * u) ** self.power)

    def energies(self, observation: Observation) -> Array:
        u = 1e2 * (observation.state.positions - self.X)
        energies = K * np.abs(u) ** (self.power + 1.0) / (self.power + 1.0) / 1e2
        return np.asarray(energies.sum(axis=1))


class Weight(OnAll, EnergyTerm):
    """A potential that is no smallest at rest."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return self.masses[:, None] * np.array([0.0, -9.81])

    def energies(self, observation: Observation) -> Array:
        return np.asarray(9.81 * self.masses * observation.state.positions[:, 1])


class Shaken(OnAll):
    """Depends on time alone."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return self.masses[:, None] * np.array([np.sin(300.0 * time), 0.0])


class QuadraticDrag(OnAll):
    """Damps nothing that is slow."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        speeds = np.linalg.norm(velocities, axis=1)
        return np.asarray(-5.0 * (self.masses * speeds)[:, None] * velocities)


class Counts(OnAll):
    """Remembers, under its own name, how long it has been at work."""

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.zeros_like(positions)

    def advance(
        self, time: float, step: float, positions: Array, velocities: Array, memory: Any
    ) -> tuple[Array, Mapping[str, Array]]:
        name = f"{self.label}: time"
        since = memory.get(name, np.zeros(len(positions)))
        force = np.zeros_like(positions)
        return force, {name: since + step}


class HalfTheFloor(Floor):
    def energies(self, observation: Observation) -> Array:
        return 0.5 * super().energies(observation)


class HalfTheHertzian(Hertzian):
    def energies(self, observation: Observation) -> Array:
        return 0.5 * super().energies(observation)


class Turns(OnAll, EnergyTerm):
    """A force across the displacement, which no energy has."""

    stiffness = K

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        u = positions - self.X
        return K * np.column_stack([-u[:, 1], u[:, 0]])

    def energies(self, observation: Observation) -> Array:
        return np.zeros(len(self.X))


class HalfLater(Hertzian):
    """Honest only before the first step."""

    stiffness = 1e2 * K
    power = 1.0

    def energies(self, observation: Observation) -> Array:
        share = 1.0 if observation.state.time == 0.0 else 0.5
        return share * super().energies(observation)


class Moves(OnAll):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        positions += 1e-3
        return np.zeros_like(positions)


class Complex(OnAll):
    def forces(self, time: float, positions: Array, velocities: Array) -> Any:
        return np.zeros(positions.shape, dtype=np.complex128)


class OtherName(Counts):
    """Remembers under a name that another part may have."""

    def advance(self, *args: Any) -> Any:
        force, _ = super().advance(*args)
        return force, {"time": np.zeros(len(force))}


class OtherNameLater(Counts):
    def advance(self, time: float, step: float, *args: Any) -> Any:
        force, kept = super().advance(time, step, *args)
        return force, kept if step == 0.0 else {"time": np.zeros(len(force))}


@attrs.frozen
class Loaded(Effect):
    kind: type[Load]

    def bind(self, model: DiscreteModel, label: str) -> Load:
        return self.kind(label, model)


def scene(kind: type[Load]) -> SceneBuilder:
    return box(2, 6).effect(Loaded(kind))


@pytest.mark.parametrize("kind", [Floor, Hertzian, Weight, Shaken, QuadraticDrag, Counts])
def test_honest_effects_are_used_without_a_word(kind: type[Load]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene(kind).build()


@pytest.mark.parametrize("kind", [HalfTheFloor, HalfTheHertzian, Turns, HalfLater])
def test_an_energy_that_is_not_the_forces_own_is_told_of(kind: type[Load]) -> None:
    with pytest.warns(PartWarning, match="the stored energy changes by"):
        scene(kind).build()


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (Moves, "read-only"),
        (Complex, "complex128; real numbers are expected"),
        (OtherName, "stores 'time'"),
        (OtherNameLater, "stores 'time'"),
    ],
)
def test_what_would_go_wrong_in_the_run_is_refused(kind: type[Load], told: str) -> None:
    with pytest.raises((BuildError, PluginError), match=told):
        scene(kind).build()


def _material(factor: float) -> Any:
    """A class of one name, as a notebook's cell makes it anew each time that it is run."""

    class Mine(NeoHookean):
        pass

    if factor != 1.0:

        def half(F: Any, params: Any) -> Any:
            P = NeoHookean.first_piola(F, params)
            return tuple(tuple(factor * one for one in row) for row in P)

        Mine.first_piola = staticmethod(half)  # type: ignore[method-assign, assignment]
    return Mine(**SOFT)


def test_a_class_that_is_defined_anew_is_asked_anew() -> None:
    wrong, right = _material(0.5), _material(1.0)
    assert repr(wrong) == repr(right)
    with pytest.warns(PartWarning, match="Mine"):
        box(2, 5).material(wrong).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        box(2, 5).material(right).build()
