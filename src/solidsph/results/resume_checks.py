"""Whether what is built now is what a record was made with, which holds no files."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.checkpoint import Checkpoint
from solidsph.results.record import Record
from solidsph.results.recorder import stress
from solidsph.run.built_scene import BuiltScene

# Other versions of libraries may round otherwise; what differs by more, in spacings, is not that.
_ROUNDING = 1e-9

_ARRAYS = ("positions", "images", "area_vectors", "volumes", "cells", "spacings", "ghosts")


def check_same_particles(record: Record, built: Particles, *, exactly: bool) -> None:
    """That the particles are those of the record.

    Args:
        record: of the run.
        built: the particles that its scene gives now.
        exactly: to the last bit; or else but for rounding.

    Raises:
        RecordError: they are not; it names the files that the scene reads, and the difference.
    """
    difference = next(_differences(record.particles, built, exactly), None)
    if difference is None:
        return
    named = ", ".join(f"{name!r}" for name in dict.fromkeys(_files(record.scene)))
    where = f" (the scene reads {named}, relative to {record.folder})" if named else ""
    raise RecordError(
        f"the run in {record.path} cannot go on: the scene no longer gives the particles that it "
        f"was begun with{where}: {difference}. Restore what the scene reads, or run it again, into "
        "another record"
    )


def check_same_output(
    record: Record, checkpoint: Checkpoint, simulation: BuiltScene, *, exactly: bool
) -> None:
    """That a checkpoint is an output of the record, and answered as it was then.

    So that neither a checkpoint of another run, nor a part or a material whose code or data have
    changed, goes on behind outputs that it would not have made.

    Raises:
        RecordError: it does not fit the simulation, or it is not, or not answered so.
    """
    state, begun = checkpoint.state, simulation.start()
    fits = state.positions.shape == begun.positions.shape
    fits &= state.applied.keys() == begun.applied.keys() == state.work.keys()
    for name, array in begun.memory.items():
        fits &= name in state.memory and state.memory[name].shape == array.shape
    if not fits:
        raise RecordError(
            f"the checkpoint beside {record.path} is of another scene than the record; delete it "
            "and resume again: the run is then carried out from its first state"
        )
    place = int(np.flatnonzero(record.times == state.time)[0])
    record.check_step(place)
    same = np.array_equal(record.positions[place], state.positions)
    same &= np.array_equal(record.field("velocity")[place], state.velocities)
    if not same:
        raise RecordError(
            f"the checkpoint beside {record.path} is not its output at t = {state.time:.9g} s; "
            "delete it and resume again: the run is then carried out from its first state"
        )
    if not exactly:
        return
    try:
        answered = stress(simulation.dynamics.observe(state))
    except (LookupError, ValueError, TypeError) as cause:
        raise RecordError(
            f"the checkpoint beside {record.path} does not fit its scene ({cause}); delete it and "
            "resume again: the run is then carried out from its first state"
        ) from None
    if not np.array_equal(record.field("cauchy_stress")[place], answered, equal_nan=True):
        raise RecordError(
            f"the run in {record.path} cannot go on bit for bit: at t = {state.time:.9g} s the "
            "scene now gives other stresses than were recorded, so a part, or something that it "
            "reads, has changed. Restore it, or force it (--force) and accept another answer"
        )


def _differences(then: Particles, now: Particles, exactly: bool) -> Iterator[str]:
    for what, one, other in (
        ("particles", then.count, now.count),
        ("bodies", list(then.bodies), list(now.bodies)),
        ("tags", list(then.tags), list(now.tags)),
        ("faces", list(then.faces), list(now.faces)),
    ):
        if one != other:
            yield f"{one} {what} were recorded, now there are {other}"
            return
    if then.bodies != now.bodies:
        yield "bodies have other numbers of particles"
    scale = float(now.spacings.min(initial=np.inf))
    for name in _ARRAYS:
        yield from _of_arrays(name, getattr(then, name), getattr(now, name), scale, exactly)
    for tag in then.tags:
        yield from _of_arrays(f"tag {tag!r}", then.tags[tag], now.tags[tag], scale, exactly)
    for face in then.faces:
        for part in ("particles", "area_vectors", "areas"):
            one, other = getattr(then.faces[face], part), getattr(now.faces[face], part)
            yield from _of_arrays(f"{part} of face {face!r}", one, other, scale, exactly)


def _of_arrays(name: str, then: Any, now: Any, scale: float, exactly: bool) -> Iterator[str]:
    one, other = np.asarray(then, dtype=np.float64), np.asarray(now, dtype=np.float64)
    if one.shape != other.shape:
        yield f"{name} are {len(one)} in the record, and {len(other)} now"
        return
    apart: Array = np.abs(one - other)
    largest = np.maximum(np.abs(one).max(initial=0.0), np.abs(other).max(initial=0.0))
    allowed = 0.0 if exactly else _ROUNDING * max(scale, float(largest))
    wrong = apart.reshape(len(apart), -1).max(axis=1, initial=0.0) > allowed
    if wrong.any():
        row, largest_apart = int(np.argmax(wrong)), float(apart.max())
        yield (
            f"{name} differ for {int(wrong.sum())} of {len(wrong)}, first for {row}: "
            f"{_short(one[row])} in the record, {_short(other[row])} now; at most "
            f"{largest_apart:.3g} apart"
        )


def _short(value: Any) -> str:
    return np.array2string(np.asarray(value), precision=9, separator=", ")


def _files(scene: str) -> Iterator[str]:
    """Files that parts of the scene read."""
    try:
        yield from _named(tomllib.loads(scene))
    except tomllib.TOMLDecodeError:  # composed in Python: it has no such form
        return


def _named(value: Any) -> Iterator[str]:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, one in items:
        if isinstance(one, (dict, list)):
            yield from _named(one)
        elif key == "file" and isinstance(one, str):
            yield one
