"""Simulation: a checked scene, ready to run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import attrs

from solidsph.assembly.builder import Builder
from solidsph.errors import UnsoundError
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.results.last_row import LastRow
from solidsph.run.built_scene import BuiltScene
from solidsph.run.motion import run_motion, time_loop
from solidsph.run.outcome import Result
from solidsph.run.progress import progress_observers
from solidsph.run.restart_point import RestartPoint
from solidsph.run.session import exclusive
from solidsph.scene.scene import Scene
from solidsph.watch.soundness import Soundness

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@attrs.frozen(eq=False, repr=False)
class Simulation(BuiltScene):
    """Everything that a run needs. A run does not change it, so it can be repeated."""

    @classmethod
    def builder(cls, scene: Scene | None = None) -> Builder[Simulation]:
        """Builder of a simulation, empty or with the contents of `scene`."""
        return Builder(cls, scene)

    def plot(self) -> Figure:
        """A picture of the scene before it runs; `Simulation.builder(scene).plot()` draws it
        without building the rest."""
        from solidsph.assembly.arrangement import arrangement_of_built
        from solidsph.results.arrangement_picture import arrangement_figure  # imports Matplotlib

        return arrangement_figure(arrangement_of_built(self))

    def time_loop(self) -> TimeLoop:
        """Loop that computes the steps."""
        return time_loop(self)

    def run(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: RestartPoint | None = None,
        progress: bool | None = None,
    ) -> Result:
        """Run the scene: find the equilibrium if it has [statics], else follow the motion.

        Args:
            record: HDF5 file to write; its folder is created. An existing record is replaced when
                the first output is complete; other files are never replaced.
            observers: objects with methods of `solidsph.run.hooks.Hooks`, called in this run only.
            since: restart point in the earlier run of `record`, from `solidsph.resume`.
            progress: whether to show how far the run is; by default in notebooks only.

        Raises:
            DivergedError: the motion diverged; earlier outputs stay readable.
            UnsoundError: the run is complete and recorded, but its energies do not balance.
            ConvergenceError: no equilibrium was found.
            BusyError: this simulation is running already, in another thread.
            RecordError: the record cannot be written, or another run writes it.
        """
        wanted = self.scene.statics
        if wanted is None:
            return self.run_motion(
                record=record, observers=observers, since=since, progress=progress
            )
        from solidsph.statics.run import run_statics  # imports the sparse solvers

        return self._run_with(
            lambda listeners: run_statics(self, wanted, listeners, since),
            record,
            [*observers, *progress_observers(self, progress)],
            since,
        )

    def run_motion(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: RestartPoint | None = None,
        progress: bool | None = None,
    ) -> Result:
        """Follow the motion to the end of the duration, even if the scene has [statics].

        Arguments and errors are those of `run`.
        """
        soundness = Soundness()
        return self._run_with(
            lambda listeners: run_motion(self, listeners, since, judge=soundness.judge),
            record,
            [soundness, *observers, *progress_observers(self, progress)],
            since,
        )

    def _run_with(
        self,
        run: Callable[[Sequence[object]], Result],
        record: Path | str | None,
        observers: Sequence[object],
        since: RestartPoint | None,
    ) -> Result:
        """Run with observers, and with those that write the record if there is one."""
        with ExitStack() as stack:
            stack.enter_context(exclusive(self))
            if record is None:
                last = LastRow()
                return _with(run, [*observers, last], lambda: {"final": last.columns()})
            # They import the file library.
            from solidsph.results.record import plotted
            from solidsph.results.recording import recording

            path = Path(record)
            checkpointer, recorder = stack.enter_context(recording(path, since))

            return _with(
                run,
                [*observers, checkpointer, recorder],
                lambda: {"record": path, "final": recorder.final, "plot": partial(plotted, path)},
            )


def _with(
    run: Callable[[Sequence[object]], Result],
    observers: Sequence[object],
    made: Callable[[], Mapping[str, Any]],
) -> Result:
    """The result of a run, also of an unsound one, with what its observers have made."""
    try:
        return attrs.evolve(run(observers), **made())
    except UnsoundError as unsound:
        unsound.result = attrs.evolve(unsound.result, **made())
        raise


solve = Simulation.run
"""The run as a function: `solve(simulation)`."""

carry_out = solve
"""The former name of `solve`."""
