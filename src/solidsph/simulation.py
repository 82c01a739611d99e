"""Simulation: a checked scene, ready to run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import final

import attrs

from solidsph.assembly.builder import Builder
from solidsph.errors import UnsoundError
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.run.built_scene import BuiltScene
from solidsph.run.motion import run_motion, time_loop
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.run.session import alone
from solidsph.scene.scene import Scene
from solidsph.watch.soundness import Soundness


@final
@attrs.frozen(eq=False)
class Simulation(BuiltScene):
    """Everything that a run needs. Running does not change it, so it can be run again."""

    @classmethod
    def builder(cls, scene: Scene | None = None) -> Builder[Simulation]:
        """A builder, empty or holding a scene."""
        return Builder(cls, scene)

    def time_loop(self) -> TimeLoop:
        """What carries out the steps."""
        return time_loop(self)

    def run(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: RestartPoint | None = None,
    ) -> Result:
        """Run the scene: find the equilibrium if it has [statics], follow the motion if not.

        Args:
            record: HDF5 file to write; the folder is made if it is missing. A record that is there
                is replaced when the first output is complete; anything else is left alone.
            observers: objects with methods of `solidsph.run.hooks.Hooks`, heard in this run only.
            since: what is taken over from an earlier run that `record` holds; `solidsph.resume`
                finds it.

        Raises:
            DivergedError: the motion went wrong; what was recorded before stays readable.
            UnsoundError: it got to its end, but its energies do not add up; all is recorded.
            ConvergenceError: no equilibrium was found.
            BusyError: this simulation is being run already, in another thread.
            RecordError: the record cannot be written, or another run writes it.
        """
        wanted = self.scene.statics
        if wanted is None:
            return self.run_motion(record=record, observers=observers, since=since)
        from solidsph.statics.run import run_statics  # brings the sparse solvers with it

        return self._heard(
            lambda heard: run_statics(self, wanted, heard, since), record, observers, since
        )

    def run_motion(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: RestartPoint | None = None,
    ) -> Result:
        """Advance from the start to the end of the duration, also a scene that has [statics].

        Arguments and errors are those of `run`.
        """
        soundness = Soundness()
        return self._heard(
            lambda heard: run_motion(self, heard, since, judge=soundness.judge),
            record,
            [soundness, *observers],
            since,
        )

    def _heard(
        self,
        run: Callable[[Sequence[object]], Result],
        record: Path | str | None,
        observers: Sequence[object],
        since: RestartPoint | None,
    ) -> Result:
        """Run with these observers, and with those that write the record if one is wanted."""
        with ExitStack() as stack:
            stack.enter_context(alone(self))
            if record is None:
                return run(observers)
            from solidsph.results.recording import recording  # brings the file library with it

            path = Path(record)
            checkpointer, recorder = stack.enter_context(recording(path, since))

            def recorded(result: Result) -> Result:
                return attrs.evolve(result, record=path, final=recorder.final)

            try:
                return recorded(run([*observers, checkpointer, recorder]))
            except UnsoundError as unsound:
                unsound.result = recorded(unsound.result)
                raise
