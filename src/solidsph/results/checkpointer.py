"""Checkpointer: the observer that keeps a checkpoint beside the record of a run."""

from __future__ import annotations

import logging
import os
import time as clock
from collections.abc import Mapping
from os.path import samestat
from pathlib import Path

from solidsph.errors import RecordError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.results.checkpoint import Checkpoint, checkpoint_path, write_checkpoint
from solidsph.results.environment import run_environment
from solidsph.results.recorder import scene_text
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import implementation
from solidsph.run.outcome import is_over

LOG = logging.getLogger(__name__)

# Share of a run's time that checkpoints may take.
SHARE = 0.01

# Time that the first checkpoint is assumed to take [s], and [s/byte]: by a disk that is not fast.
_WRITING, _BYTE = 0.02, 5e-9


class Checkpointer:
    """Writes a checkpoint at outputs, as often as a hundredth of the run's time allows.

    A run leaves a checkpoint of its last output when it ends, finished or not: a finished one can
    be extended. A run that is killed before the first was due leaves none; `resume` then starts
    from its first state.
    """

    def __init__(self, record: Path, *, is_resumed: bool = False) -> None:
        self._record = record
        self._path = checkpoint_path(record)
        self._is_ours = is_resumed  # the checkpoint; otherwise it is of a run that is replaced
        self._recorded: os.stat_result | None = None  # identity of the record's file
        self._state: State | None = None
        self._simulation: BuiltScene | None = None  # that reached it; a run may cut its step
        self._kept: Mapping[str, Array] = {}
        self._environment: Mapping[str, str] = {}  # once it has been asked for
        self._is_written = False
        self._last = clock.perf_counter()
        self._cost: float | None = None  # of the last checkpoint [s]

    @implementation(trylast=True)
    def solidsph_resume(self, simulation: BuiltScene, observation: Observation) -> None:
        # At once: the end of the run, or its step, may differ from those in the older checkpoint.
        self._take(simulation, observation)
        self._write()

    @implementation(trylast=True)
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        # Last of all observers: where one stops the run, this state gets no checkpoint.
        if not self._is_ours:
            # The record is the new run's by now, so the older run's checkpoint is of no use.
            self._path.unlink(missing_ok=True)
            self._is_ours = True
        self._take(simulation, observation)
        if self._is_due(observation.state):
            self._write()

    @implementation
    def solidsph_finish(self, outcome: str) -> None:
        if self._is_written or not self._is_recorded:
            return
        try:
            self._write()
        except RecordError:
            if is_over(outcome):
                raise
            # Otherwise the error that stopped the run is the one to report.

    def _take(self, simulation: BuiltScene, observation: Observation) -> None:
        self._state, self._simulation = observation.state, simulation
        self._is_written = False
        if self._recorded is None:  # the recorder comes before
            self._recorded = self._record.stat()
        kept: dict[str, Array] = {}
        simulation.manager.hook.solidsph_keep(simulation=simulation, kept=kept)
        self._kept = kept

    @property
    def _is_recorded(self) -> bool:
        """True if the record is still there, and no other file in its place."""
        try:
            return self._recorded is not None and samestat(self._recorded, self._record.stat())
        except OSError:
            return False

    def _is_due(self, state: State) -> bool:
        cost = self._cost if self._cost is not None else _WRITING + _BYTE * _size(state)
        return (clock.perf_counter() - self._last) * SHARE >= cost

    def _write(self) -> None:
        simulation = self._simulation
        if self._state is None or simulation is None or simulation.scene.statics is not None:
            return  # load steps depend on those before; an equilibrium starts from the first
        begun = clock.perf_counter()
        self._environment = self._environment or run_environment(simulation)
        checkpoint = Checkpoint(
            state=self._state,
            scene=scene_text(simulation),
            step_size=simulation.step_size,
            steps=simulation.steps,
            halvings=simulation.halvings,
            environment=self._environment,
            kept=self._kept,
        )
        write_checkpoint(self._path, checkpoint)
        self._last = clock.perf_counter()
        self._cost, self._is_written = self._last - begun, True
        LOG.debug("checkpoint of t = %.6g s in %.3g s", self._state.time, self._cost)


def _size(state: State) -> int:
    arrays = (state.positions, state.velocities, state.accelerations)
    named = (*state.memory.values(), *state.applied.values())
    return sum(array.nbytes for array in (*arrays, *named))
