"""Simulation: a checked scene, ready to run; the time loop, and nothing else."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import pluggy

from solidsph.blame import culprit
from solidsph.dynamics import Dynamics
from solidsph.engines.engine import Engine
from solidsph.errors import (
    BuildError,
    DivergedError,
    PluginError,
    SceneError,
    SolidsphError,
    UnsoundError,
)
from solidsph.hooks import heard_by
from solidsph.interfaces.condition import Condition, Observation
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.integrator import Integrator
from solidsph.particles import Particles, State, read_only
from solidsph.registry import Entry
from solidsph.resumption import Resumption
from solidsph.scene import Scene
from solidsph.session import session
from solidsph.setting import Setting
from solidsph.soundness import Soundness
from solidsph.time_loop import StepError, TimeLoop

if TYPE_CHECKING:
    from solidsph.builder import Builder


@attrs.frozen(eq=False)
class Result:
    """What a run leaves behind."""

    state: State  # the last one
    record: Path | None  # the file written, if one was asked for
    seconds: float  # wall time of the run, compiling and recording included [s]
    effort: Mapping[str, Any]  # what it took besides: "quantity [unit]" -> a number, or yes or no
    final: Mapping[str, float] = attrs.field(factory=dict)  # the last row of a record's history
    notes: Sequence[str] = ()  # what happened to the run, as in the record


@attrs.frozen(eq=False)
class Simulation:
    """Everything that a run needs. Running does not change it, so it can be run again."""

    scene: Scene
    setting: Setting
    dynamics: Dynamics
    conditions: Sequence[Condition]
    effects: Mapping[str, Effect]
    integrator: Integrator
    engine: Engine
    initial: State
    step_size: float  # [s]
    steps: int
    parts: tuple[Entry, ...]  # every plugin used
    manager: pluggy.PluginManager
    halvings: int = 0  # of the step that the scene asks for

    @staticmethod
    def builder(scene: Scene | None = None) -> Builder:
        """A builder, empty or holding a scene."""
        from solidsph.builder import Builder  # the builder imports this module

        return Builder(scene)

    @property
    def particles(self) -> Particles:
        """The reference configuration."""
        return self.dynamics.particles

    def start(self) -> State:
        """The state at the first step, with imposed motions, accelerations and accounts."""
        positions = self.dynamics.place(self.initial.time, self.initial.positions)
        velocities = self.dynamics.carry(self.initial.time, self.initial.velocities)
        state = attrs.evolve(self.initial, positions=positions, velocities=velocities)
        with np.errstate(all="ignore"):  # as in the steps that follow
            return self.integrator.start(state, self.dynamics, self.step_size)

    @property
    def compiles_steps(self) -> bool:
        """Whether whole steps are compiled, as far as the kinds of the parts tell."""
        return self.dynamics.internal.compiles_steps(self.dynamics, self.integrator)

    def time_loop(self) -> TimeLoop:
        """What carries out the steps."""
        if self.scene.sleep is not None:
            from solidsph.asleep import sleeping_loop  # only where something sleeps

            return sleeping_loop(self)
        return self.dynamics.internal.time_loop(self.dynamics, self.integrator, self.step_size)

    def extended(self, steps: int) -> Simulation:
        """The same, of so many steps in all: the step and the outputs up to now stay as they are.

        Raises:
            SceneError: the scene has more steps than that.
        """
        if steps < self.steps:
            raise SceneError(f"{steps} steps in all are fewer than the {self.steps} that there are")
        return attrs.evolve(self, steps=steps)

    def halved(self) -> Simulation:
        """The same scene, built anew with half the step."""
        builder = self.builder(attrs.evolve(self.scene, time_step=0.5 * self.step_size))
        finer = builder.build()
        return attrs.evolve(
            finer, scene=self.scene, steps=2 * self.steps, halvings=self.halvings + 1
        )

    def run(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: Resumption | None = None,
    ) -> Result:
        """Carry out the scene: find the equilibrium if it has [statics], follow the motion if not.

        Args:
            record: HDF5 file to write; the folder is made if it is missing. A record that is there
                is replaced when the first output is complete; anything else is left alone.
            observers: objects with methods of `solidsph.hooks.Moments`, heard in this run only.
            since: what is taken over from an earlier run that `record` holds; `solidsph.resume`
                finds it.

        Raises:
            DivergedError: the motion went wrong; what was recorded before stays readable.
            UnsoundError: it got to its end, but its energies do not add up; all is recorded.
            ConvergenceError: no equilibrium was found.
            BusyError: this simulation is being run already, in another thread.
            RecordError: the record cannot be written, or another run writes it.
        """
        if self.scene.statics is None:
            return self.run_motion(record=record, observers=observers, since=since)
        from solidsph.statics.run import run_statics  # brings the sparse solvers with it

        wanted = self.scene.statics
        return run_statics(self, wanted, record=record, observers=observers, since=since)

    def run_motion(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: Resumption | None = None,
    ) -> Result:
        """Advance from the start to the end of the duration, also a scene that has [statics].

        Arguments and errors are those of `run`.
        """
        path = None if record is None else Path(record)
        begun = clock.perf_counter()
        soundness = Soundness()

        def result() -> Result:
            return Result(
                state=state,
                record=path,
                seconds=clock.perf_counter() - begun,
                effort={"steps": state.step, "step size [s]": self.step_size, **loop.effort},
                final=final,
                notes=() if since is None else since.notes,
            )

        hook = self.manager.hook
        try:
            with session(self, path, [soundness, *observers], since) as final:
                loop = self.time_loop()
                if since is None or since.state is None:
                    state = self.start()
                    hook.solidsph_step_end(simulation=self, observation=self._observe(state))
                else:
                    state = since.state
                    observation = self._observe(state)
                    hook.solidsph_resume(simulation=self, observation=observation, kept=since.kept)
                for stop in self.output_steps():
                    if stop <= state.step:
                        continue
                    try:
                        state = loop.advance(state, stop)
                    except StepError as failed:
                        raise self._diverged(failed.state, failed.cause) from failed
                    hook.solidsph_step_end(simulation=self, observation=self._observe(state))
                soundness.judge(self)
        except UnsoundError as unsound:
            unsound.result = result()
            raise
        except (SolidsphError, OSError, MemoryError, Warning):
            raise
        except Exception as cause:
            who = culprit(cause, self.parts) or heard_by(cause, self.manager)
            if not who:
                raise
            raise PluginError(
                f"{who} failed in the run: {type(cause).__name__}: {cause}; this is a fault of "
                "that part"
            ) from cause
        return result()

    def output_steps(self) -> tuple[int, ...]:
        """Steps after which the state is observed, evenly spread, the last one among them."""
        # In steps of the scene's own size, so that halving them changes no time.
        size = 2**self.halvings
        asked, steps = round(self.scene.duration / self.step_size) // size, self.steps / size
        count = min(self.scene.outputs, asked)
        marks = np.linspace(0, asked, count + 1)[1:]
        if steps > asked:  # extended
            apart = asked / count
            further = np.arange(count + 1, ceil(steps / apart)) * apart
            marks = np.concatenate([marks, further])
        whole = np.append(size * np.rint(marks).astype(np.int64), self.steps)
        return tuple(int(step) for step in np.unique(whole) if step <= self.steps)

    def _observe(self, state: State) -> Observation:
        observation = self.dynamics.observe(read_only(state))
        turned = ~(observation.volume_ratios > 0.0) & ~self.particles.ghosts
        if turned.any():
            raise self._diverged(state, "the volume has vanished or turned inside out")
        return observation

    def _diverged(self, state: State, cause: str) -> DivergedError:
        try:
            with np.errstate(all="ignore"):
                J = np.linalg.det(self.dynamics.observe(state).deformation_gradients)
        except (BuildError, ValueError):  # positions may be such that nothing has neighbours
            J = np.full(self.particles.count, np.nan)
        real = np.flatnonzero(~self.particles.ghosts)
        finite = np.isfinite(J[real])
        # The first particle whose volume ratio is no number, or else the most compressed one.
        worst = real[np.argmin(finite)] if not finite.all() else real[np.argmin(J[real])]
        error = DivergedError(
            step=state.step,
            time=state.time,
            particle=int(worst),
            volume_ratio=float(J[worst]),
            cause=cause,
        )
        self.manager.hook.solidsph_failure(simulation=self, state=state, error=error)
        return error
