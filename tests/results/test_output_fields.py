"""Fields and columns of one name are found when a scene is built."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import attrs
import numpy as np
import pytest

from solidsph import BuildError, Effect, Record
from solidsph.interfaces.terms import (
    EnergyTerm,
    FieldTerm,
    Load,
    Observation,
)
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import box

HEAT = {"conductivity": 1.0, "heat_capacity": 10.0}
COPPER = {
    "youngs_modulus": 1e6,
    "poissons_ratio": 0.3,
    "density": 1000.0,
    "yield_stress": 1e4,
    "hardening_modulus": 1e4,
    "hardening_exponent": 0.5,
    "rate_coefficient": 0.01,
    "softening_exponent": 1.0,
    "melting_temperature": 1300.0,
    "specific_heat": 400.0,
}


@attrs.frozen
class _Showing(FieldTerm, EnergyTerm, Load):
    label: str
    shows: Mapping[str, int]
    reports: Mapping[str, float]
    particles: np.ndarray = attrs.field(factory=lambda: np.zeros(0, dtype=np.intp))

    def forces(self, time: float, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return np.zeros((0, positions.shape[1]))

    def energies(self, observation: Observation) -> np.ndarray:
        return np.zeros(observation.particles.count)

    def fields(self, observation: Observation) -> Mapping[str, np.ndarray]:
        return {name: np.zeros(observation.particles.count) for name in self.shows}

    def report(self, observation: Observation) -> Mapping[str, float]:
        return self.reports


@attrs.frozen
class Showing(Effect):
    """Shows and reports whatever it is told to; it adds nothing else."""

    shows: tuple[str, ...] = ()
    reports: tuple[str, ...] = ()

    def bind(self, model, label):
        return _Showing(label, dict.fromkeys(self.shows, 1), dict.fromkeys(self.reports, 0.0))


def small() -> SceneBuilder:
    return box(2, 6).outputs(1)


def test_two_temperatures_are_recorded_each_by_its_label(tmp_path: Path) -> None:
    """docs/effects.md: materials that remember may conduct. Each starts as its own says."""
    path = tmp_path / "run.h5"
    builder = small().material("johnson-cook", **COPPER)
    builder.effect("heat", **HEAT, initial=5.0)
    builder.effect("heat", **HEAT, initial=7.0, label="second")
    builder.build().run(record=path)
    with Record(path) as record:
        starts = {
            name: float(record.field(name)[0].max())
            for name in ("temperature", "heat temperature", "second temperature")
        }
    assert starts == {"temperature": 293.0, "heat temperature": 5.0, "second temperature": 7.0}


@pytest.mark.parametrize("label", ["kinetic", "strain"])
def test_the_energies_keep_their_columns(label: str) -> None:
    with pytest.raises(BuildError, match=rf"column '{label} energy \[J\]'; give '{label}' another"):
        small().effect("hourglass-control", label=label).build()


def test_the_dissipated_energy_keeps_its_column() -> None:
    builder = small().material("johnson-cook", **COPPER)
    with pytest.raises(BuildError, match=r"column 'dissipated energy \[J\]'"):
        builder.effect("hourglass-control", label="dissipated").build()


@pytest.mark.parametrize(
    ("first", "second", "what"),
    [
        ({"shows": ("glow [K]",)}, {"shows": ("glow [K]",)}, "field 'glow'"),
        # The unit is no part of a field's name.
        ({"shows": ("glow [K]",)}, {"shows": ("glow [-]",)}, "field 'glow'"),
        ({"reports": ("sum [N]",)}, {"reports": ("sum [N]",)}, "column 'sum [N]'"),
        ({}, {"shows": ("velocity [m/s]",)}, "field 'velocity'"),
        ({}, {"shows": ("volume [m^2]",)}, "field 'volume'"),
        ({}, {"shows": ("tags [-]",)}, "field 'tags'"),
        ({}, {"reports": ("kinetic energy [J]",)}, "column 'kinetic energy [J]'"),
        ({}, {"reports": ("work of one [J]",)}, "column 'work of one [J]'"),
    ],
)
def test_names_are_compared_at_the_build(first, second, what) -> None:
    builder = small().effect(Showing(**first), label="one")
    builder.effect(Showing(**second), label="two")
    with pytest.raises(BuildError) as caught:
        builder.build()
    (problem,) = caught.value.problems
    assert what in problem
    assert "'two'" in problem


@pytest.mark.parametrize(
    ("label", "message"),
    [
        ("", "is empty"),
        ("  \t", "is empty"),
        ("x" * 201, "201 characters"),
        ("a\0b", "unprintable"),
    ],
)
def test_labels_that_name_nothing(label: str, message: str) -> None:
    with pytest.raises(BuildError, match=message):
        small().effect("hourglass-control", label=label).build()


@pytest.mark.parametrize("label", ["a/b", "..", "a [b]", "Größe", "x" * 200])
def test_labels_that_a_file_must_carry(tmp_path: Path, label: str) -> None:
    path = tmp_path / "run.h5"
    small().effect("hourglass-control", label=label).build().run(record=path)
    with Record(path) as record:
        assert f"{label} energy [J]" in record.history
        assert record.field(f"{label} share".replace("/", "%2F")).unit == "-"


def test_a_long_place_makes_no_label_that_is_refused(tmp_path: Path) -> None:
    where = " or ".join(["X < 0.1"] * 60)
    small().boundary("clamp", where=where).build().run(record=tmp_path / "run.h5")
