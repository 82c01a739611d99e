"""Recorder: the observer that writes a run's record."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from solidsph.errors import SceneError
from solidsph.hooks import implementation
from solidsph.interfaces.condition import FieldCondition, Observation
from solidsph.results.energy import kinetic_energy, ledger, strain_energy
from solidsph.results.layout import field_name
from solidsph.results.record_writer import Field, PluginUsed, RecordWriter

if TYPE_CHECKING:
    from solidsph.arrays import Array
    from solidsph.simulation import Simulation


class Recorder:
    """Writes every observation to one HDF5 file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer: RecordWriter | None = None
        self._initial_energy = 0.0

    @implementation
    def solidsph_setup(self, simulation: Simulation) -> None:
        # A run that fails before its first output must not seem to have left an older record.
        self._path.unlink(missing_ok=True)

    @implementation
    def solidsph_step_end(self, simulation: Simulation, observation: Observation) -> None:
        if self._writer is None:
            self._initial_energy = kinetic_energy(observation) + strain_energy(observation)
            self._writer = self._open(simulation, observation)
        state = observation.state
        self._writer.append(
            state.time,
            state.step,
            state.positions,
            _fields(observation)
            | {name: values for name, _, values in _conditions_fields(simulation, observation)},
            self._history(simulation, observation),
        )

    @implementation
    def solidsph_finish(self, simulation: Simulation, outcome: str) -> None:
        if self._writer is not None:
            self._writer.close(outcome)

    def _open(self, simulation: Simulation, observation: Observation) -> RecordWriter:
        d = simulation.particles.dimension
        columns = self._history(simulation, observation)
        return RecordWriter(
            self._path,
            simulation.particles,
            scene=scene_text(simulation),
            plugins=[
                PluginUsed(e.kind, e.name, e.distribution, e.version, e.target)
                for e in simulation.parts
            ],
            fields=[
                Field("velocity", (d,), "m/s"),
                Field("cauchy_stress", (d, d), "Pa"),
                Field("volume_ratio", (), "-"),
                *(
                    Field(name, values.shape[1:], unit)
                    for name, unit, values in _conditions_fields(simulation, observation)
                ),
            ],
            columns={name: _parted(name)[1] for name in columns},
        )

    def _history(self, simulation: Simulation, observation: Observation) -> dict[str, float]:
        columns = dict(ledger(observation, self._initial_energy))
        for condition in simulation.conditions:
            columns |= condition.report(observation)
        return columns


def _conditions_fields(
    simulation: Simulation, observation: Observation
) -> Iterator[tuple[str, str, Array]]:
    """Name, unit and values of every field that conditions have to show."""
    for condition in simulation.conditions:
        if isinstance(condition, FieldCondition):
            for name, values in condition.fields(observation).items():
                quantity, unit = _parted(name)
                yield field_name(quantity), unit, values


def _parted(name: str) -> tuple[str, str]:
    """Quantity and unit of "quantity [unit]"."""
    quantity, _, unit = name.rpartition(" [")
    return quantity, unit.rstrip("]")


def scene_text(simulation: Simulation) -> str:
    """The scene as TOML, or why it has no such form."""
    try:
        return simulation.scene.to_toml()
    except SceneError as cause:
        # A scene of Python objects runs all the same; its record says why it cannot be rerun.
        return f"# this scene was composed in Python and has no file form: {cause}\n"


def _fields(observation: Observation) -> dict[str, Array]:
    F, P = observation.deformation_gradients, observation.stresses
    J = np.linalg.det(F)
    sigma = np.einsum("pik,pjk->pij", P, F) / J[:, None, None]
    return {
        "velocity": observation.state.velocities,
        "cauchy_stress": sigma,
        "volume_ratio": J,
    }
