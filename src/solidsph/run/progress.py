"""Progress of a run, by its outputs."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from typing import final

from solidsph.interfaces.terms import Observation
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import implementation
from solidsph.system.progress_display import ProgressDisplay, progress_display, time_left


def part_done(simulation: BuiltScene, observation: Observation) -> float:
    """Part of a run that is done at an output, from 0 to 1."""
    # By time, not by counting: load steps are halved and doubled on the way.
    moves = simulation.scene.statics is None
    end = simulation.steps * simulation.step_size if moves else simulation.scene.duration
    return min(1.0, observation.state.time / end)


@final
class RunProgress:
    """Observer that shows how far a run is."""

    def __init__(self, display: ProgressDisplay) -> None:
        self._display = display
        self._part = 0.0
        self._first: float | None = None  # part done at the first output, where a run resumes
        self._begun = clock.perf_counter()

    @implementation
    def solidsph_setup(self, simulation: BuiltScene) -> None:
        self._begun = clock.perf_counter()
        self._display.show(0.0)

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        self._part = part_done(simulation, observation)
        if self._first is None:
            self._first = self._part
        done, elapsed = self._part - self._first, clock.perf_counter() - self._begun
        left = elapsed * (1.0 - self._part) / done if done > 0.0 else None
        self._display.show(self._part, time_left(left))

    @implementation
    def solidsph_finish(self, simulation: BuiltScene, outcome: str) -> None:
        seconds = clock.perf_counter() - self._begun
        self._display.close(self._part, f"{outcome.partition(':')[0]} after {seconds:.3g} s")


def progress_observers(simulation: BuiltScene, wanted: bool | None) -> Sequence[object]:
    """The observer that shows the progress of a run, if it is to be shown.

    Args:
        simulation: what runs.
        wanted: whether it is; by default in notebooks only.
    """
    display = progress_display(simulation.scene.title or "run", wanted)
    return [] if display is None else [RunProgress(display)]
