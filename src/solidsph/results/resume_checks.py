"""Checks before a run goes on: what is built now must be what the record was made with."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.checkpoint import START_OVER, Checkpoint
from solidsph.results.layout import PARTICLE_ARRAYS
from solidsph.results.output_fields import stress
from solidsph.results.record import Record
from solidsph.results.scene_files import FILE, file_versions, scene_files
from solidsph.run.built_scene import BuiltScene
from solidsph.system.files import working_folder

# Other versions of libraries may round differently; a larger difference, in spacings, is a change.
_ROUNDING = 1e-9


def check_same_particles(record: Record, built: Particles, *, exactly: bool) -> None:
    """Raise RecordError unless the scene still gives the particles of its record.

    They must agree `exactly`, or else up to rounding. The message names the files that the scene
    reads, which the record does not hold.
    """
    difference = next(_differences(record.particles, built, exactly), None)
    if difference is None:
        return
    files = ", ".join(f"{name!r}" for name in dict.fromkeys(scene_files(record.scene)))
    where = f" (the scene reads {files}, relative to {record.folder})" if files else ""
    raise RecordError(
        f"the run in {record.path} cannot go on: the scene no longer gives the particles that it "
        f"was begun with{where}: {difference}. Restore what the scene reads, or run it again, into "
        "another record"
    )


def check_same_files(record: Record) -> None:
    """Raise RecordError unless the files that bodies are read from are those of the record."""
    now = file_versions(record.scene, working_folder())
    changed = [
        repr(name.removeprefix(FILE))
        for name, digest in record.versions.items()
        if name.startswith(FILE) and now.get(name) != digest
    ]
    if changed:
        raise RecordError(
            f"the run in {record.path} cannot go on: {', '.join(changed)} (relative to "
            f"{record.folder}) changed since it was begun, though the particles are the same. "
            "Restore it, or force it (--force)"
        )


def check_same_output(
    record: Record, checkpoint: Checkpoint, simulation: BuiltScene, *, exactly: bool
) -> None:
    """Raise RecordError unless a checkpoint is an output of the record and fits the simulation.

    If `exactly`, it must also give the recorded stresses. So parts or materials whose code or data
    have changed are refused: their outputs must not follow those in the record.
    """
    state, start = checkpoint.state, simulation.start()
    beside = f"the checkpoint beside {record.path}"
    fits = state.positions.shape == start.positions.shape
    fits &= state.applied.keys() == start.applied.keys() == state.work.keys()
    for name, array in start.memory.items():
        fits &= name in state.memory and state.memory[name].shape == array.shape
    if not fits:
        raise RecordError(f"{beside} is of another scene than the record; {START_OVER}")
    place = int(np.flatnonzero(record.times == state.time)[0])
    output = record.checked_output(place)
    is_same = np.array_equal(output.positions, state.positions)
    is_same &= np.array_equal(output.fields["velocity"], state.velocities)
    if not is_same:
        raise RecordError(f"{beside} is not its output at t = {state.time:.9g} s; {START_OVER}")
    if not exactly:
        return
    try:
        stresses = stress(simulation.dynamics.observe(state))
    except (LookupError, ValueError, TypeError) as cause:
        raise RecordError(f"{beside} does not fit its scene ({cause}); {START_OVER}") from None
    if not np.array_equal(output.fields["cauchy_stress"], stresses, equal_nan=True):
        raise RecordError(
            f"the run in {record.path} cannot go on bit for bit: at t = {state.time:.9g} s the "
            "scene now gives other stresses than were recorded, so a part, or something that it "
            "reads, has changed. Restore it, or force it (--force) and accept another answer"
        )


def _differences(then: Particles, now: Particles, exactly: bool) -> Iterator[str]:
    for what, recorded, built in (
        ("particles", then.count, now.count),
        ("bodies", list(then.bodies), list(now.bodies)),
        ("tags", list(then.tags), list(now.tags)),
        ("faces", list(then.faces), list(now.faces)),
    ):
        if recorded != built:
            yield f"{recorded} {what} were recorded, now there are {built}"
            return
    if then.bodies != now.bodies:
        yield "bodies have other numbers of particles"
    arrays = [(name, getattr(then, name), getattr(now, name)) for name in PARTICLE_ARRAYS.values()]
    arrays += [(f"tag {tag!r}", mask, now.tags[tag]) for tag, mask in then.tags.items()]
    arrays += [
        (f"{part} of face {name!r}", getattr(face, part), getattr(now.faces[name], part))
        for name, face in then.faces.items()
        for part in ("particles", "area_vectors", "areas")
    ]
    scale = float(now.spacings.min(initial=np.inf))
    for name, recorded_array, built_array in arrays:
        yield from _array_differences(name, recorded_array, built_array, scale, exactly)


def _array_differences(
    name: str, then: Any, now: Any, scale: float, exactly: bool
) -> Iterator[str]:
    recorded, built = np.asarray(then, dtype=np.float64), np.asarray(now, dtype=np.float64)
    if recorded.shape != built.shape:
        yield f"{name} are {len(recorded)} in the record, and {len(built)} now"
        return
    apart: Array = np.abs(recorded - built)
    largest = np.maximum(np.abs(recorded).max(initial=0.0), np.abs(built).max(initial=0.0))
    allowed = 0.0 if exactly else _ROUNDING * max(scale, float(largest))
    wrong = apart.reshape(len(apart), -1).max(axis=1, initial=0.0) > allowed
    if wrong.any():
        row, largest_apart = int(np.argmax(wrong)), float(apart.max())
        yield (
            f"{name} differ for {int(wrong.sum())} of {len(wrong)}, first for {row}: "
            f"{_short(recorded[row])} in the record, {_short(built[row])} now; at most "
            f"{largest_apart:.3g} apart"
        )


def _short(value: Any) -> str:
    return np.array2string(np.asarray(value), precision=9, separator=", ")
