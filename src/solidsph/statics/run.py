"""Static run: an equilibrium, observed and recorded like a motion."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence

import attrs

from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.run.session import session
from solidsph.scene.scene_data import StaticsScene
from solidsph.statics.equilibrium import equilibrium

_UNSTABLE = (
    "the equilibrium is unstable: the body would leave it, as a strip does beyond its buckling "
    "load, or is free to slide or roll. To find what it goes to, add a small load aside, or follow "
    "a damped motion"
)


def run_statics(
    simulation: BuiltScene,
    wanted: StaticsScene,
    listeners: Sequence[object],
    since: RestartPoint | None = None,
) -> Result:
    """Find the equilibrium, with outputs of the unloaded state and of every load step.

    The time of an output is its load factor times the duration. Work is integrated by the
    trapezoidal rule over the load steps, so the energy residual depends on their number. A
    resumed run is repeated from the beginning; its record stays.

    Raises:
        ConvergenceError: no equilibrium was found; earlier load steps stay readable.
    """
    start = clock.perf_counter()

    def observe(state: State) -> None:
        observation = simulation.dynamics.observe(state)
        simulation.manager.hook.solidsph_step_end(simulation=simulation, observation=observation)

    with session(simulation, listeners):
        result = equilibrium(simulation, **attrs.asdict(wanted), observer=observe)
    simulation.dynamics.internal.note(simulation.dynamics.internal.compilations)
    return Result(
        state=result.state,
        record=None,
        seconds=clock.perf_counter() - start,
        effort={
            "load steps": len(result.steps),
            "iterations": result.iterations,
            "residual [-]": result.residual,
            "stable": result.stable,
        },
        notes=[
            *(() if since is None else since.notes),
            *([_UNSTABLE] if result.stable is False else []),
        ],
        values_at=simulation.values_at,
    )
