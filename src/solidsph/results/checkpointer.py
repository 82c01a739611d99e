"""Checkpointer: the observer that keeps a checkpoint beside the record of a run."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from solidsph.errors import RecordError
from solidsph.hooks import implementation
from solidsph.interfaces.condition import Observation
from solidsph.particles import State
from solidsph.results.checkpoint import Checkpoint, write_checkpoint
from solidsph.results.circumstances import circumstances
from solidsph.results.recorder import remove, scene_text
from solidsph.session import is_over

if TYPE_CHECKING:
    from solidsph.arrays import Array
    from solidsph.simulation import Simulation

# Of the time that a run takes, what checkpoints may take.
SHARE = 0.01

# What the first one takes before it is known [s], and [s/byte]: a disk that is not fast.
_WRITING, _BYTE = 0.02, 5e-9


class Checkpointer:
    """Writes a checkpoint at outputs, as often as a hundredth of the time that has gone by allows.

    A run that does not get to its end leaves one of its last output. A run that is over before the
    first was due leaves none, and is gone on with from its first state.
    """

    def __init__(self, path: Path, *, is_resumed: bool = False) -> None:
        self._path = path
        self._is_resumed = is_resumed
        self._state: State | None = None
        self._kept: Mapping[str, Array] = {}
        self._found: Mapping[str, str] = {}  # the circumstances, once they have been asked for
        self._is_written = False
        self._last = clock.perf_counter()
        self._cost: float | None = None  # of the last one [s]

    @implementation
    def solidsph_setup(self, simulation: Simulation) -> None:
        if not self._is_resumed:
            # Of an older run, which this one takes the place of.
            remove(self._path)

    @implementation(trylast=True)
    def solidsph_resume(
        self, simulation: Simulation, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        # At once: the end of the run, or its step, may be another than the older one says.
        self._hear(simulation, observation)
        self._write(simulation)

    @implementation(trylast=True)
    def solidsph_step_end(self, simulation: Simulation, observation: Observation) -> None:
        # Last of all listeners: one that stops the run keeps this state from being gone on with.
        self._hear(simulation, observation)
        if self._is_due(observation.state):
            self._write(simulation)

    @implementation
    def solidsph_finish(self, simulation: Simulation, outcome: str) -> None:
        state = self._state
        if state is None or self._is_written:
            return
        if not is_over(outcome):
            try:
                self._write(simulation)
            except RecordError:  # what stopped the run is what is to be told
                return
        elif self._is_due(state):
            self._write(simulation)

    def _hear(self, simulation: Simulation, observation: Observation) -> None:
        self._state, self._is_written = observation.state, False
        kept: dict[str, Array] = {}
        simulation.manager.hook.solidsph_keep(simulation=simulation, kept=kept)
        self._kept = kept

    def _is_due(self, state: State) -> bool:
        cost = self._cost if self._cost is not None else _WRITING + _BYTE * _size(state)
        return (clock.perf_counter() - self._last) * SHARE >= cost

    def _write(self, simulation: Simulation) -> None:
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
