"""Recorder: the observer that writes a run's record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from solidsph.errors import RecordError, SceneError
from solidsph.interfaces.terms import Observation
from solidsph.results.earlier_run import check_no_other_file
from solidsph.results.output_fields import OWN, history, parted
from solidsph.results.output_fields import fields as shown_fields
from solidsph.results.record import Record
from solidsph.results.record_writer import EarlierStep, Field, PluginUsed, RecordWriter
from solidsph.run.energy import KINETIC, STRAIN, kinetic_energy, strain_energy
from solidsph.run.hooks import implementation
from solidsph.run.restart_point import RestartPoint

if TYPE_CHECKING:
    from solidsph.maths.arrays import Array
    from solidsph.run.built_scene import BuiltScene


COMPOSED = "# this scene was composed in Python"
"""How the text of a scene begins that has no file form."""

# What comes out the same again if a run repeats an output that its record holds.
_REPEATED = ("velocity", "cauchy_stress")


class Recorder:
    """Writes every observation to one HDF5 file, behind those of an earlier run if it has any."""

    def __init__(self, path: Path, since: RestartPoint | None = None) -> None:
        self._path = path
        self._since = since
        self._writer: RecordWriter | None = None
        self._folder: str | None = None  # where an earlier run's relative paths begin
        self._initial_energy = 0.0
        self._recorded: Record | None = None  # outputs that the run has to repeat
        self.final: dict[str, float] = {}  # columns of the history at the last output so far

    @implementation
    def solidsph_setup(self, simulation: BuiltScene) -> None:
        # What is there stays until there is something to take its place.
        if self._since is None:
            check_no_other_file(self._path)

    @implementation
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        self._writer = self._open(simulation, observation)
        self.final.update(self._history(simulation, observation))

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        if self._writer is None:
            self._writer = self._open(simulation, observation)
        state = observation.state
        fields = _fields(observation) | {
            name: values for name, _, values in shown_fields(observation, simulation.terms)
        }
        columns = self._history(simulation, observation)
        self.final.update(columns)
        if state.time <= self._writer.last_time:
            self._check_repeated(observation, fields)
            return
        self._writer.append(state.time, state.step, state.positions, fields, columns)

    @implementation
    def solidsph_finish(self, simulation: BuiltScene, outcome: str) -> None:
        if self._recorded is not None:
            self._recorded.close()
        if self._writer is not None:
            self._writer.close(outcome)

    def _open(self, simulation: BuiltScene, observation: Observation) -> RecordWriter:
        d = simulation.particles.dimension
        earlier = self._earlier()
        if earlier is None:
            self._initial_energy = kinetic_energy(observation) + strain_energy(observation)
        else:
            first = (earlier.history[name][0] for name in (KINETIC, STRAIN))
            self._initial_energy = float(sum(first))
        columns = self._history(simulation, observation)
        writer = RecordWriter(
            self._path,
            simulation.particles,
            scene=scene_text(simulation),
            plugins=[
                PluginUsed(e.kind, e.name, e.distribution, e.version, e.target)
                for e in simulation.parts
            ],
            fields=[
                *(
                    Field(name, components, unit)
                    for (name, unit), components in zip(
                        OWN.items(), ((d,), (d, d), ()), strict=True
                    )
                ),
                *(
                    Field(name, values.shape[1:], unit)
                    for name, unit, values in shown_fields(observation, simulation.terms)
                ),
            ],
            columns={name: parted(name)[1] for name in columns},
            earlier=() if earlier is None else _steps(earlier, self._kept_until),
            notes=() if self._since is None else self._since.notes,
            folder=self._folder,
        )
        if earlier is not None and observation.state.time <= writer.last_time:
            self._recorded = Record(self._path)
        return writer

    @property
    def _kept_until(self) -> float:
        return -np.inf if self._since is None else self._since.until

    def _earlier(self) -> Record | None:
        """The record of the earlier run, if it holds a step that stays."""
        if self._since is None or not self._path.exists():
            return None
        record = Record(self._path)
        self._folder = record.folder
        if not record.count or record.times[0] > self._kept_until:
            record.close()
            return None
        return record

    def _check_repeated(self, observation: Observation, fields: Mapping[str, Array]) -> None:
        """That an output which the record holds has come out the same again."""
        if self._recorded is None or self._since is None or not self._since.repeats:
            return
        state, recorded = observation.state, self._recorded
        place = int(np.searchsorted(recorded.times, state.time))
        same = place < recorded.count and recorded.times[place] == state.time
        if same:
            values = {"": state.positions, **{name: fields[name] for name in _REPEATED}}
            same = all(
                np.array_equal(
                    recorded.field(name)[place] if name else recorded.positions[place],
                    value,
                    equal_nan=True,
                )
                for name, value in values.items()
            )
        if not same:
            raise RecordError(
                f"the run does not repeat its record {self._path} at t = {state.time:.9g} s: "
                "something that decides its bits is not as it was; what is recorded stays. To go "
                "on all the same, force it; to be sure, run the scene anew into another record"
            )

    def _history(self, simulation: BuiltScene, observation: Observation) -> dict[str, float]:
        return history(observation, self._initial_energy, simulation.terms)


def _steps(record: Record, until: float) -> Iterator[EarlierStep]:
    """The steps of a record up to a time; the record is closed then."""
    with record:
        for place, time in enumerate(record.times):
            if time <= until:
                record.check_step(place)
                yield EarlierStep(
                    time=float(time),
                    step=int(record.steps[place]),
                    positions=record.positions[place],
                    fields={name: record.field(name)[place] for name in record.field_names},
                    history={name: float(one[place]) for name, one in record.history.items()},
                )


def scene_text(simulation: BuiltScene) -> str:
    """The scene as TOML, or why it has no such form."""
    try:
        return simulation.scene.to_toml()
    except SceneError as cause:
        # A scene of Python objects runs all the same; its record says why it cannot be rerun.
        return f"{COMPOSED} and has no file form: {cause}\n"


def stress(observation: Observation) -> Array:
    """Cauchy stress P F^T / J of every particle, (n, d, d) [Pa]."""
    F, P = observation.deformation_gradients, observation.stresses
    sigma: Array = np.einsum("pik,pjk->pij", P, F) / observation.volume_ratios[:, None, None]
    return sigma


def _fields(observation: Observation) -> dict[str, Array]:
    return {
        "velocity": observation.state.velocities,
        "cauchy_stress": stress(observation),
        "volume_ratio": observation.volume_ratios,
    }
