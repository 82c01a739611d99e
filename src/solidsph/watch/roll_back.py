"""Rolling back: a run that failed goes on from its last sound output with half the step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path

import attrs
import numpy as np

from solidsph.errors import DivergedError, UnsoundError
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.watch.symptom import Finding, Symptom
from solidsph.watch.watchdog import SYMPTOMS, Watchdog


def run_watched(
    simulation: BuiltScene,
    *,
    record: Path | str,
    roll_backs: int = 0,
    symptoms: Sequence[Symptom] = SYMPTOMS,
    observers: Sequence[object] = (),
    told: Callable[[float, Finding], None] = lambda time, finding: None,
) -> Result:
    """Run under a watchdog; on a failure go back to the last sound output and halve the step.

    What the record holds of later outputs is taken out of it, and a note says so. A failure leaves
    a picture beside the record, and, if there is no going back any more, a checkpoint.

    Args:
        simulation: what to run.
        record: HDF5 file to write.
        roll_backs: how often to go back at most.
        symptoms: what to look for.
        observers: as in `Simulation.run`.
        told: called with the time [s] of every finding, and the finding.

    Raises:
        DivergedError: it failed once more than that; with the particle, the cause and a remedy.
        UnsoundError: its energies did not add up once more than that.
    """
    path = Path(record)
    since: RestartPoint | None = None
    notes: list[str] = []
    while True:
        picture = path.with_name(f"{path.stem}-watchdog.png")
        watchdog = Watchdog(symptoms, picture=picture, told=told)
        try:
            return simulation.run(record=path, observers=[watchdog, *observers], since=since)
        except (DivergedError, UnsoundError) as failed:
            if len(notes) >= roll_backs:
                raise
            simulation = simulation.halved()
            good = watchdog.good
            back = 0.0 if good is None else good.state.time
            notes.append(
                f"rolled back from t = {failed.time:.9g} s to t = {back:.9g} s, step halved to "
                f"{simulation.step_size:.9g} s: {_told(failed)}"
            )
            if good is None:
                since = RestartPoint(until=-inf, notes=tuple(notes))
            else:
                state = restarted(simulation, good.state)
                since = RestartPoint(state, good.kept, until=back, notes=tuple(notes))


def _told(failed: DivergedError | UnsoundError) -> str:
    if isinstance(failed, UnsoundError):
        return f"the energies did not add up, by {failed.part:.3g} of what was in play"
    return f"{failed.cause} at particle {failed.particle}"


def restarted(simulation: BuiltScene, state: State) -> State:
    """An output of the same scene with twice the step, made ready to go on with this one."""
    dynamics = simulation.dynamics
    moved = attrs.evolve(
        state,
        step=2 * state.step,
        positions=dynamics.place(state.time, state.positions),
        velocities=dynamics.carry(state.time, state.velocities),
    )
    with np.errstate(all="ignore"):  # as in the steps that follow
        begun = simulation.integrator.start(moved, dynamics, simulation.step_size)
    return attrs.evolve(begun, work=dict(state.work))
