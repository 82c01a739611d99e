"""Recorder: the observer that writes a run's record."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from solidsph.errors import RecordError, SceneError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.results.contents import Output, Reference, installed
from solidsph.results.earlier_run import check_no_other_file
from solidsph.results.layout import PluginUsed
from solidsph.results.output_fields import fields, history, split_unit
from solidsph.results.record import Record
from solidsph.results.record_writer import RecordWriter
from solidsph.results.scene_files import file_versions
from solidsph.run.built_scene import BuiltScene
from solidsph.run.energy import KINETIC, STRAIN, kinetic_energy, strain_energy
from solidsph.run.hooks import implementation
from solidsph.run.restart_point import RestartPoint
from solidsph.system.files import working_folder

LOG = logging.getLogger(__name__)

COMPOSED = "# this scene was composed in Python"
"""Beginning of the text of a scene that has no file form."""

# What must come out the same if a run repeats an output that its record holds.
_REPEATED = ("velocity", "cauchy_stress")


class Recorder:
    """Writes every observation to one HDF5 file, behind those of an earlier run if it has any."""

    def __init__(self, path: Path, since: RestartPoint | None = None) -> None:
        self._path = path
        self._since = since
        self._kept_until = -np.inf if since is None else since.until  # of an earlier record [s]
        self._writer: RecordWriter | None = None
        self._folder: str | None = None  # where an earlier run's relative paths begin
        self._initial_energy = 0.0
        self._recorded: Record | None = None  # outputs that the run has to repeat
        self.final: dict[str, float] = {}  # columns of the history at the last output so far

    @implementation
    def solidsph_setup(self) -> None:
        # An earlier record stays until there is something to take its place.
        if self._since is None:
            check_no_other_file(self._path)

    @implementation
    def solidsph_resume(self, simulation: BuiltScene, observation: Observation) -> None:
        self._writer = self._open(simulation, observation)
        self.final.update(self._history(simulation, observation))

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        if self._writer is None:
            self._writer = self._open(simulation, observation)
        state = observation.state
        values = {field.name: array for field, array in fields(observation, simulation.terms)}
        columns = self._history(simulation, observation)
        self.final.update(columns)
        if state.time <= self._writer.last_time:
            self._check_repeated(observation, values)
            return
        self._writer.append(Output(state.time, state.step, state.positions, values, columns))

    @implementation
    def solidsph_finish(self, outcome: str) -> None:
        if self._recorded is not None:
            self._recorded.close()
        if self._writer is not None:
            self._writer.close(outcome)

    def _open(self, simulation: BuiltScene, observation: Observation) -> RecordWriter:
        earlier = self._earlier()
        if earlier is None:
            self._initial_energy = kinetic_energy(observation) + strain_energy(observation)
        else:
            first = (earlier.history[name][0] for name in (KINETIC, STRAIN))
            self._initial_energy = float(sum(first))
        columns = self._history(simulation, observation)
        text = scene_text(simulation)
        folder = str(working_folder()) if self._folder is None else self._folder
        reference = Reference(
            particles=simulation.particles,
            scene=text,
            plugins=[PluginUsed.of(entry) for entry in simulation.parts],
            fields=[field for field, _ in fields(observation, simulation.terms)],
            columns={name: split_unit(name)[1] for name in columns},
            notes=() if self._since is None else self._since.notes,
            folder=folder,
            versions={**installed(), **file_versions(text, Path(folder))},
        )
        outputs = () if earlier is None else _outputs(earlier, self._kept_until)
        LOG.info("recording into %s", self._path)
        writer = RecordWriter(self._path, reference, earlier=outputs)
        if earlier is not None and observation.state.time <= writer.last_time:
            self._recorded = Record(self._path)
        return writer

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

    def _check_repeated(self, observation: Observation, values: Mapping[str, Array]) -> None:
        """Check that an output which the record holds has come out the same again."""
        if self._recorded is None or self._since is None or not self._since.repeats:
            return
        state, recorded = observation.state, self._recorded
        place = int(np.searchsorted(recorded.times, state.time))
        is_same = place < recorded.count and recorded.times[place] == state.time
        if is_same:
            pairs = [(recorded.positions[place], state.positions)]
            pairs += [(recorded.field(name)[place], values[name]) for name in _REPEATED]
            is_same = all(np.array_equal(*pair, equal_nan=True) for pair in pairs)
        if not is_same:
            raise RecordError(
                f"the run does not repeat its record {self._path} at t = {state.time:.9g} s: "
                "something that its last digits depend on has changed; the record stays as it is. "
                "To go on all the same, force it; to be sure, run the scene again into another "
                "record"
            )

    def _history(self, simulation: BuiltScene, observation: Observation) -> dict[str, float]:
        terms = (*simulation.terms, *simulation.probes)
        return history(observation, self._initial_energy, terms)


def _outputs(record: Record, until: float) -> Iterator[Output]:
    """The outputs of a record up to a time [s], after which the record is closed."""
    with record:
        for place, time in enumerate(record.times):
            if time <= until:
                yield record.checked_output(place)


def scene_text(simulation: BuiltScene) -> str:
    """The scene as TOML, or why it has no such form."""
    try:
        return simulation.scene.to_toml()
    except SceneError as cause:
        # A scene of Python objects runs all the same; its record says why it cannot be rerun.
        return f"{COMPOSED} and has no file form: {cause}\n"
