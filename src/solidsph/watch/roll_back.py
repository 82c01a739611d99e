"""Rolling back: a run that failed goes on from its last sound output with half the step."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path

import attrs

from solidsph.errors import DivergedError, UnsoundError
from solidsph.run.built_scene import BuiltScene
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.run.step_follower import restarted
from solidsph.watch.symptom import Finding, Symptom
from solidsph.watch.watchdog import SYMPTOMS, Watchdog

LOG = logging.getLogger(__name__)


def run_watched(
    simulation: BuiltScene,
    *,
    record: Path | str,
    roll_backs: int = 0,
    symptoms: Sequence[Symptom] = SYMPTOMS,
    observers: Sequence[object] = (),
    on_finding: Callable[[float, Finding], None] = lambda time, finding: None,
) -> Result:
    """Run under a watchdog; on a failure go back to the last sound output and halve the step.

    Later outputs are removed from the record, and a note says so. A failure leaves a picture
    beside the record, and the last one a checkpoint.

    Args:
        simulation: what to run.
        record: HDF5 file to write.
        roll_backs: how often to go back at most.
        symptoms: what to look for.
        observers: as in `Simulation.run`.
        on_finding: called with the time [s] of every finding, and the finding.

    Raises:
        DivergedError: it failed once more than that; with the particle, the cause and a remedy.
        UnsoundError: its energies did not add up once more than that.
    """
    path = Path(record)
    picture = path.with_name(f"{path.stem}-watchdog.png")
    since: RestartPoint | None = None
    notes: list[str] = []
    while True:
        watchdog = Watchdog(symptoms, picture=picture, on_finding=on_finding)
        try:
            return simulation.run(record=path, observers=[watchdog, *observers], since=since)
        except (DivergedError, UnsoundError) as error:
            if len(notes) >= roll_backs:
                raise
            # The run may have cut its step by itself before.
            simulation = (watchdog.simulation or simulation).halved()
            sound = watchdog.last_sound
            notes.append(
                f"rolled back from t = {error.time:.9g} s to "
                f"t = {0.0 if sound is None else sound.state.time:.9g} s, step halved to "
                f"{simulation.step_size:.9g} s: {_reason(error)}"
            )
            LOG.info(notes[-1])
            since = RestartPoint(until=-inf, notes=tuple(notes))
            if sound is not None:
                state = restarted(simulation, sound.state, sound.halvings)
                since = attrs.evolve(since, state=state, kept=sound.kept, until=sound.state.time)


def _reason(error: DivergedError | UnsoundError) -> str:
    if isinstance(error, UnsoundError):
        return f"the energies did not add up, by {error.part:.3g} of the energy in play"
    return f"{error.cause} at particle {error.particle}"
