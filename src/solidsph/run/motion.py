"""Motion of a scene from its initial state to the end of its duration."""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Callable, Sequence

from solidsph.errors import PluginError, SolidsphError, UnsoundError
from solidsph.interfaces.time_loop import StepError, TimeLoop
from solidsph.registry.origin import failing_part
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import failed_plugin
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.run.session import session
from solidsph.run.step_by_step import steps_of
from solidsph.run.step_follower import StepFollower

LOG = logging.getLogger(__name__)


def time_loop(simulation: BuiltScene) -> TimeLoop:
    """Loop that computes the steps of a scene."""
    if simulation.scene.sleep is not None:
        from solidsph.run.sleeping.loop import sleeping_loop  # loaded only for [sleep]

        return sleeping_loop(simulation)
    return steps_of(simulation.dynamics, simulation.integrator)


def run_motion(
    simulation: BuiltScene,
    listeners: Sequence[object],
    since: RestartPoint | None = None,
    *,
    judge: Callable[[BuiltScene], None] = lambda simulation: None,
) -> Result:
    """Run a scene to the end of its duration.

    Args:
        simulation: the scene.
        listeners: objects with methods of `solidsph.run.hooks.Hooks`, called in this run only.
        since: restart point in an earlier run.
        judge: called at the end of the duration; raises UnsoundError if the result is wrong.

    Raises:
        DivergedError: the motion diverged.
        UnsoundError: raised by `judge`; it has the result.
        PluginError: a part failed.
    """
    start = clock.perf_counter()
    hook = simulation.manager.hook

    def result() -> Result:
        return Result(
            state=state,
            record=None,
            seconds=clock.perf_counter() - start,
            effort={"steps": state.step, "step size [s]": simulation.step_size, **loop.effort},
            notes=[*(() if since is None else since.notes), *follower.cuts],
            values_at=simulation.values_at,
        )

    follower = StepFollower(simulation)
    failure: tuple[BuiltScene, StepError] | None = None  # the first of a stretch that is repeated
    try:
        with session(simulation, [follower, *listeners]):
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
            while state.step < simulation.steps:
                before = simulation
                simulation, state = follower.followed(simulation, state, observation)
                if simulation is not before:
                    loop = time_loop(simulation)
                output = next(step for step in simulation.output_steps() if step > state.step)
                try:
                    state = loop.advance(state, follower.next_check(state, output))
                except StepError as failed:
                    failure = failure or (simulation, failed)
                    repeated = follower.repeated(simulation, state, failed.cause)
                    if repeated is None:
                        failing, failed = failure
                        raise failing.diverged(failed.state, failed.cause) from failed
                    simulation, state = repeated
                    loop = time_loop(simulation)
                    continue
                failure = None
                if state.step < output:
                    observation = simulation.dynamics.observe(state)
                    continue
                observation = simulation.observe(state)
                LOG.debug("output at t = %.6g s, step %d", state.time, state.step)
                hook.solidsph_step_end(simulation=simulation, observation=observation)
            simulation.dynamics.internal.note(simulation.plan.compilations)
            judge(simulation)
    except UnsoundError as unsound:
        unsound.result = result()
        raise
    except (SolidsphError, OSError, MemoryError, Warning):
        raise
    except Exception as cause:
        who = failing_part(cause, simulation.parts) or failed_plugin(cause, simulation.manager)
        if not who:
            raise
        raise PluginError(
            f"{who} failed in the run: {type(cause).__name__}: {cause}; correct that part"
        ) from cause
    return result()
