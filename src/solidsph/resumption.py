"""Resuming: an earlier run goes on in its own record, bit for bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path

import attrs

from solidsph.errors import RecordError
from solidsph.results.checkpoint import START_OVER, Checkpoint, checkpoint_path, read_checkpoint
from solidsph.results.environment import differences, is_part, part_versions, run_environment
from solidsph.results.record import Record
from solidsph.results.recorder import COMPOSED, scene_text
from solidsph.results.resume_checks import (
    check_same_files,
    check_same_output,
    check_same_particles,
)
from solidsph.results.scene_files import FILE
from solidsph.results.sole_writer import check_no_writer
from solidsph.run.outcome import Result, is_over
from solidsph.run.restart_point import RestartPoint
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import MOST_STEPS
from solidsph.simulation import Simulation
from solidsph.system.files import relative_to

# Part of a step by which an end may be missed.
_NEAR = 1e-6


@attrs.frozen(eq=False)
class Pending:
    """A run that is not over, ready to go on."""

    path: Path
    simulation: Simulation
    since: RestartPoint

    def solve(self, observers: Sequence[object] = (), progress: bool | None = None) -> Result:
        """Go on to the end; the record is then that of one run without a break."""
        return self.simulation.run(
            record=self.path, observers=observers, since=self.since, progress=progress
        )


def resume(
    path: Path | str,
    *,
    simulation: Simulation | None = None,
    until: float | None = None,
    force: bool = False,
    observers: Sequence[object] = (),
    progress: bool | None = None,
) -> Result:
    """Go on with the run that was recorded at `path`, in the same record.

    Args:
        path: the record.
        simulation: what was run; by default it is built from the scene in the record, which is not
            possible for a scene that was composed of Python objects.
        until: a later end than the scene's duration [s], rounded up to a whole step.
        force: go on although versions, plugins or the number of threads have changed; the last
            digits may then differ from those of one run without a break.
        observers: as in `Simulation.run`.
        progress: whether to show how far the run is; by default in notebooks only.

    Raises:
        RecordError: the run is finished; the record or its checkpoint cannot be read or do not
            belong together; another run is writing it; or something has changed that the last
            digits depend on, such as a version, or a file that a body is read from.
    """
    run = pending(Path(path), simulation=simulation, until=until, force=force)
    if run is None:
        raise RecordError(f"the run in {path} is over; give `until` to extend it")
    return run.solve(observers, progress)


def pending(
    path: Path,
    *,
    simulation: Simulation | None = None,
    until: float | None = None,
    force: bool = False,
) -> Pending | None:
    """Make a run ready to go on, with the arguments and errors of `resume`; None if it is over."""
    check_no_writer(path)
    with Record(path) as record, relative_to(Path(record.folder) if record.folder else None):
        if is_over(record.outcome) and until is None:
            return None
        checkpoint = _checkpoint(record)
        if simulation is None:
            simulation = _built(record)
        elif scene_text(simulation) != record.scene:
            raise RecordError(
                f"the record {path} is of another scene than the one given; give the same, or "
                "record into another file"
            )
        check_same_particles(record, simulation.particles, exactly=not force)
        simulation = _as_before(simulation, checkpoint)
        if not force:
            check_same_files(record)
            _check_environment(record, checkpoint, simulation)
        notes = list(record.notes)
        if until is not None:
            simulation = _extended(simulation, until)
            notes.append(f"extended to t = {simulation.steps * simulation.step_size:.9g} s")
        since = RestartPoint(notes=notes, repeats=not force)
        if checkpoint is not None and checkpoint.state.time in record.times:
            check_same_output(record, checkpoint, simulation, exactly=not force)
            since = attrs.evolve(since, state=checkpoint.state, kept=checkpoint.kept)
        return Pending(path, simulation, since)


def _checkpoint(record: Record) -> Checkpoint | None:
    path = checkpoint_path(record.path)
    if not path.exists():
        return None
    checkpoint = read_checkpoint(path)
    if checkpoint.scene != record.scene:
        raise RecordError(
            f"the checkpoint {path} is of another scene than the record {record.path}; {START_OVER}"
        )
    return checkpoint


def _built(record: Record) -> Simulation:
    if record.scene.startswith(COMPOSED):
        raise RecordError(
            f"the scene of {record.path} was composed of Python objects and cannot be built from "
            "its record; build it in Python again, then solidsph.resume(path, simulation=...)"
        )
    scene = Scene.from_toml(record.scene, f"the scene in {record.path}")
    return Simulation.builder(scene).build()


def _as_before(simulation: Simulation, checkpoint: Checkpoint | None) -> Simulation:
    """The simulation with the step size and the number of steps that the run had."""
    if checkpoint is None:
        return simulation
    for _ in range(checkpoint.halvings - simulation.halvings):
        simulation = simulation.halved()
    if simulation.step_size != checkpoint.step_size:
        raise RecordError(
            f"the run had a time step of {checkpoint.step_size:.9g} s, the scene now has one of "
            f"{simulation.step_size:.9g} s; install the versions that it was begun with"
        )
    return simulation.extended(max(simulation.steps, checkpoint.steps))


def _check_environment(
    record: Record, checkpoint: Checkpoint | None, simulation: Simulation
) -> None:
    now = run_environment(simulation)
    if checkpoint is not None:
        then = checkpoint.environment
    else:
        then = _recorded_environment(record)
        now = {name: value for name, value in now.items() if name in then or is_part(name)}
    changes = differences(then, now)
    if changes:
        raise RecordError(
            f"the run in {record.path} cannot go on bit for bit: {'; '.join(changes)}. Install "
            "what it was begun with, or force it (--force) and accept other last digits"
        )


def _recorded_environment(record: Record) -> Mapping[str, str]:
    """The part of the environment that the record itself holds."""
    software = {
        name: version
        for name, version in record.versions.items()
        if name not in ("h5py", "hdf5") and not name.startswith(FILE)
    }
    return {**software, **part_versions(record.plugins)}


def _extended(simulation: Simulation, until: float) -> Simulation:
    end = simulation.steps * simulation.step_size
    if simulation.scene.statics is not None:
        raise RecordError("an equilibrium has no later end; leave `until` (--until) out")
    if not end * (1.0 - _NEAR) <= until < float("inf"):
        raise RecordError(
            f"until = {until:.9g} s is before the end of the run, {end:.9g} s; give a later one"
        )
    if until / simulation.step_size > MOST_STEPS:
        raise RecordError(
            f"until = {until:.9g} s is {until / simulation.step_size:.3g} steps away, at most "
            f"{MOST_STEPS:.0e} are allowed; give an earlier one"
        )
    return simulation.extended(max(simulation.steps, ceil(until / simulation.step_size - _NEAR)))
