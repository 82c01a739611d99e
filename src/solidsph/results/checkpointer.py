"""Checkpointer: the observer that keeps a checkpoint beside the record of a run."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Mapping
from os.path import samestat
from pathlib import Path
from typing import TYPE_CHECKING

from solidsph.errors import RecordError
from solidsph.interfaces.terms import Observation
from solidsph.model.particles import State
from solidsph.results.checkpoint import Checkpoint, checkpoint_path, write_checkpoint
from solidsph.results.environment import circumstances
from solidsph.results.recorder import scene_text
from solidsph.run.hooks import implementation
from solidsph.run.outcome import is_over

if TYPE_CHECKING:
    from solidsph.maths.arrays import Array
    from solidsph.run.built_scene import BuiltScene

# Of the time that a run takes, what checkpoints may take.
SHARE = 0.01

# What the first one takes before it is known [s], and [s/byte]: a disk that is not fast.
_WRITING, _BYTE = 0.02, 5e-9


class Checkpointer:
    """Writes a checkpoint at outputs, as often as a hundredth of the time that has gone by allows.

    At its end a run leaves one of its last output, whether it got to the end that was asked for,
    so that it can be extended, or not. One that is killed before the first was due leaves none, and
    is gone on with from its first state.
    """

    def __init__(self, record: Path, *, is_resumed: bool = False) -> None:
        self._record = record
        self._path = checkpoint_path(record)
        self._is_ours = is_resumed  # not of an older run, which this one takes the place of
        self._recorded: os.stat_result | None = None  # which file is the record
        self._state: State | None = None
        self._kept: Mapping[str, Array] = {}
        self._found: Mapping[str, str] = {}  # the circumstances, once they have been asked for
        self._is_written = False
        self._last = clock.perf_counter()
        self._cost: float | None = None  # of the last one [s]

    @implementation(trylast=True)
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        # At once: the end of the run, or its step, may be another than the older one says.
        self._hear(simulation, observation)
        self._write(simulation)

    @implementation(trylast=True)
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        # Last of all listeners: one that stops the run keeps this state from being gone on with.
        if not self._is_ours:
            # The record is the new run's by now, so the older one's checkpoint is of no more use.
            self._path.unlink(missing_ok=True)
            self._is_ours = True
        self._hear(simulation, observation)
        if self._is_due(observation.state):
            self._write(simulation)

    @implementation
    def solidsph_finish(self, simulation: BuiltScene, outcome: str) -> None:
        if self._is_written or not self._is_recorded:
            return
        try:
            self._write(simulation)
        except RecordError:
            if is_over(outcome):
                raise
            # Otherwise what stopped the run is what is to be told.

    def _hear(self, simulation: BuiltScene, observation: Observation) -> None:
        self._state, self._is_written = observation.state, False
        if self._recorded is None:  # the recorder has heard it before
            self._recorded = self._record.stat()
        kept: dict[str, Array] = {}
        simulation.manager.hook.solidsph_keep(simulation=simulation, kept=kept)
        self._kept = kept

    @property
    def _is_recorded(self) -> bool:
        """Whether the record is still there, and no other in its place."""
        try:
            return self._recorded is not None and samestat(self._recorded, self._record.stat())
        except OSError:
            return False

    def _is_due(self, state: State) -> bool:
        cost = self._cost if self._cost is not None else _WRITING + _BYTE * _size(state)
        return (clock.perf_counter() - self._last) * SHARE >= cost

    def _write(self, simulation: BuiltScene) -> None:
        if self._state is None or simulation.scene.statics is not None:
            return  # load steps depend on those before; an equilibrium is found anew
        begun = clock.perf_counter()
        self._found = self._found or circumstances(simulation)
        checkpoint = Checkpoint(
            state=self._state,
            scene=scene_text(simulation),
            step_size=simulation.step_size,
            steps=simulation.steps,
            halvings=simulation.halvings,
            circumstances=self._found,
            kept=self._kept,
        )
        write_checkpoint(self._path, checkpoint)
        self._last = clock.perf_counter()
        self._cost, self._is_written = self._last - begun, True


def _size(state: State) -> int:
    arrays = (state.positions, state.velocities, state.accelerations)
    named = (*state.memory.values(), *state.applied.values())
    return sum(array.nbytes for array in (*arrays, *named))
