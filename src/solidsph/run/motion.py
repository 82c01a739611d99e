"""Motion: a scene followed from its first state to the end of its duration."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence

from solidsph.errors import PluginError, SolidsphError, UnsoundError
from solidsph.interfaces.time_loop import StepError, TimeLoop
from solidsph.registry.origin import culprit
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import failed_plugin
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.run.session import session
from solidsph.run.step_by_step import steps_of


def time_loop(simulation: BuiltScene) -> TimeLoop:
    """What carries out the steps."""
    if simulation.scene.sleep is not None:
        from solidsph.run.sleeping.loop import sleeping_loop  # only where something sleeps

        return sleeping_loop(simulation)
    return steps_of(simulation.dynamics, simulation.integrator)


def run_motion(
    simulation: BuiltScene,
    listeners: Sequence[object],
    since: RestartPoint | None = None,
    *,
    judge: Callable[[BuiltScene], None] = lambda simulation: None,
) -> Result:
    """Advance to the end of the duration.

    Args:
        simulation: what to run.
        listeners: objects with methods of `solidsph.run.hooks.Hooks`, heard in this run only.
        since: what is taken over from an earlier run.
        judge: called at the end of the duration; it raises UnsoundError if the run is wrong.

    Raises:
        DivergedError: the motion went wrong.
        UnsoundError: by `judge`, with the result.
        PluginError: a part failed.
    """
    begun = clock.perf_counter()
    hook = simulation.manager.hook

    def result() -> Result:
        return Result(
            state=state,
            record=None,
            seconds=clock.perf_counter() - begun,
            effort={"steps": state.step, "step size [s]": simulation.step_size, **loop.effort},
            notes=() if since is None else since.notes,
        )

    try:
        with session(simulation, listeners):
            loop = time_loop(simulation)
            if since is None or since.state is None:
                state = simulation.start()
                observation = simulation.observe(state)
                hook.solidsph_step_end(simulation=simulation, observation=observation)
            else:
                state = since.state
                observation = simulation.observe(state)
                hook.solidsph_resume(
                    simulation=simulation, observation=observation, kept=since.kept
                )
            for stop in simulation.output_steps():
                if stop <= state.step:
                    continue
                try:
                    state = loop.advance(state, stop)
                except StepError as failed:
                    raise simulation.diverged(failed.state, failed.cause) from failed
                observation = simulation.observe(state)
                hook.solidsph_step_end(simulation=simulation, observation=observation)
            judge(simulation)
    except UnsoundError as unsound:
        unsound.result = result()
        raise
    except (SolidsphError, OSError, MemoryError, Warning):
        raise
    except Exception as cause:
        who = culprit(cause, simulation.parts) or failed_plugin(cause, simulation.manager)
        if not who:
            raise
        raise PluginError(
            f"{who} failed in the run: {type(cause).__name__}: {cause}; this is a fault of "
            "that part"
        ) from cause
    return result()
