"""The static run: an equilibrium, heard and recorded as a motion is."""

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


def run_statics(
    simulation: BuiltScene,
    wanted: StaticsScene,
    listeners: Sequence[object],
    since: RestartPoint | None = None,
) -> Result:
    """Find the equilibrium; the unloaded body and every load step are outputs.

    The time of an output is its load factor times the duration, its step the number of load
    steps. Work is the trapezoidal rule over load steps: the energy residual is that of a path
    followed in so few. An earlier run is taken up from its beginning: what it recorded stays.

    Raises:
        ConvergenceError: none was found; the load steps up to there stay readable.
    """
    begun = clock.perf_counter()

    def observe(state: State) -> None:
        observation = simulation.dynamics.observe(state)
        simulation.manager.hook.solidsph_step_end(simulation=simulation, observation=observation)

    with session(simulation, listeners):
        found = equilibrium(simulation, **attrs.asdict(wanted), observer=observe)
    return Result(
        state=found.state,
        record=None,
        seconds=clock.perf_counter() - begun,
        effort={
            "load steps": len(found.steps),
            "iterations": found.iterations,
            "residual [-]": found.residual,
            "stable": found.stable,
        },
        notes=() if since is None else since.notes,
    )
