"""Checkpoint: a complete state in a file of its own, from which a run goes on bit for bit.

The file begins with a line of text, `solidsph checkpoint FORMAT DIGEST`, and goes on in what NumPy
calls npz. The digest is of all that follows the line, so that no damage goes unnoticed, and nothing
in the file is ever executed.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import sys
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.scene.scene_data import MOST_STEPS
from solidsph.system.files import content
from solidsph.system.signals import uninterrupted

FORMAT = 1
_MAGIC = "solidsph checkpoint"
_LONGEST_HEAD = 200  # bytes
_ARRAYS = ("positions", "velocities", "accelerations")
_NAMED = ("memory", "applied")

# What reading an npz may raise; after the digest only a fault of ours can.
_NPZ_ERRORS = (
    *(OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError),
    *(zipfile.BadZipFile, MemoryError, RecursionError, NotImplementedError),
)

_MOST_HALVINGS = 60  # of a step: then a double no longer tells one from the next


@attrs.frozen(eq=False)
class Checkpoint:
    """All that a run needs to go on from one of its outputs."""

    state: State
    scene: str  # as in the record
    step_size: float  # [s]
    steps: int  # in all
    halvings: int  # of the scene's own step
    circumstances: Mapping[str, str]
    kept: Mapping[str, Array]  # what listeners keep, by names of theirs


def checkpoint_path(record: Path) -> Path:
    """Where the checkpoint of a record is: beside the file itself, where the path is a link."""
    real = Path(os.path.realpath(record))
    # Records of two suffixes may have one stem.
    return real.with_name(f"{real.stem if real.suffix == '.h5' else real.name}.checkpoint")


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write it to the disk, whole; an older one stays until then.

    Raises:
        RecordError: it cannot be written; an older one is still there.
    """
    body = _packed(checkpoint)
    head = f"{_MAGIC} {FORMAT} {_digest(body)}\n".encode()
    draft = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        with uninterrupted():
            path.parent.mkdir(parents=True, exist_ok=True)
            with draft.open("wb") as file:
                file.write(head)
                file.write(body)
                file.flush()
                os.fsync(file.fileno())
            draft.replace(path)
    except OSError as cause:
        raise RecordError(
            f"cannot write the checkpoint {path}: {cause.strerror or cause}; the record, and the "
            "checkpoint before this one if there was any, are as they were: free some space or "
            "choose another folder, then resume"
        ) from None
    finally:
        with suppress(OSError):  # it is gone after a success
            draft.unlink()


def read_checkpoint(path: Path) -> Checkpoint:
    """The checkpoint in a file.

    Raises:
        RecordError: there is none, it is damaged, or a newer solidsph wrote it.
    """
    try:
        data = content(path, sys.maxsize)
    except OSError as cause:
        raise RecordError(
            f"the checkpoint {path} cannot be read: {cause.strerror or cause}; check the path"
        ) from None
    head, end, body = data[:_LONGEST_HEAD].partition(b"\n")
    words = head.decode("ascii", errors="replace").removeprefix(_MAGIC).split()
    if not (end and head.startswith(_MAGIC.encode()) and len(words) == 2 and words[0].isdecimal()):
        raise RecordError(f"{path} is not a checkpoint of solidsph, or its beginning is lost")
    # Bounded, since a number of any length would be as good a file.
    if len(words[0]) > 9 or int(words[0]) > FORMAT:
        raise RecordError(
            f"the checkpoint {path} has format {words[0][:9]}, this solidsph reads up to {FORMAT}; "
            "update solidsph"
        )
    if int(words[0]) < FORMAT:
        raise RecordError(
            f"the checkpoint {path} has the older format {words[0]}, this solidsph reads {FORMAT}; "
            "delete it and resume again: the run is then carried out from its first state, and "
            "what is recorded stays"
        )
    body = data[len(head) + 1 :]
    damaged = (
        f"the checkpoint {path} is damaged; delete it and resume again: the run is then carried "
        "out from its first state, and what is recorded stays"
    )
    if _digest(body) != words[1]:
        raise RecordError(damaged)
    try:
        return _unpacked(body)
    except _NPZ_ERRORS as cause:
        raise RecordError(f"{damaged} ({type(cause).__name__}: {cause})") from None


def _digest(body: bytes) -> str:
    return hashlib.blake2b(body, digest_size=32).hexdigest()


def _packed(checkpoint: Checkpoint) -> bytes:
    state = checkpoint.state
    arrays = {name: getattr(state, name) for name in _ARRAYS}
    named = {**{name: getattr(state, name) for name in _NAMED}, "kept": checkpoint.kept}
    for group, values in named.items():
        arrays |= {f"{group} {number}": value for number, value in enumerate(values.values())}
    facts = {
        "time": state.time,
        "step": state.step,
        "work": dict(state.work),
        "names": {group: list(values) for group, values in named.items()},
        "scene": checkpoint.scene,
        "step_size": checkpoint.step_size,
        "steps": checkpoint.steps,
        "halvings": checkpoint.halvings,
        "circumstances": dict(checkpoint.circumstances),
    }
    # JSON gives every finite double back, and says NaN and infinities in words that it reads.
    text = np.frombuffer(json.dumps(facts).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, facts=text, **arrays)
    return file.getvalue()


def _unpacked(body: bytes) -> Checkpoint:
    with zipfile.ZipFile(io.BytesIO(body)) as parts:
        if sum(one.file_size for one in parts.infolist()) > len(body):
            raise ValueError("it claims more bytes than it has")
    with np.load(io.BytesIO(body), allow_pickle=False) as data:
        arrays: dict[str, Any] = {name: data[name] for name in data.files}
    facts = json.loads(bytes(arrays.pop("facts")))
    named = {
        group: {name: arrays[f"{group} {number}"] for number, name in enumerate(names)}
        for group, names in facts["names"].items()
    }
    found = Checkpoint(
        state=State(
            time=facts["time"],
            step=facts["step"],
            work=facts["work"],
            positions=arrays["positions"],
            velocities=arrays["velocities"],
            accelerations=arrays["accelerations"],
            memory=named["memory"],
            applied=named["applied"],
        ),
        scene=facts["scene"],
        step_size=facts["step_size"],
        steps=facts["steps"],
        halvings=facts["halvings"],
        circumstances=facts["circumstances"],
        kept=named["kept"],
    )
    _check(found)
    return found


def _check(found: Checkpoint) -> None:
    """That all is of the types and sizes that a run leaves; a digest tells only that it is whole.

    Raises:
        ValueError: something is not.
    """
    state = found.state
    shape = state.positions.shape
    moving = {name: getattr(state, name) for name in _ARRAYS}
    for name, array in (*moving.items(), *state.applied.items()):
        if array.dtype != np.float64 or array.ndim != 2 or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} of shape {array.shape}, not of {shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} is not finite")
    for name, array in (*state.memory.items(), *found.kept.items()):
        if array.dtype.kind not in "fiub":
            raise ValueError(f"{name} holds {array.dtype}, which are no numbers")
    for name, value, least in (
        *(("time", state.time, 0.0), ("step size", found.step_size, 5e-324)),
        *((name, value, -np.inf) for name, value in state.work.items()),
    ):
        if not isinstance(value, float) or not np.isfinite(value) or value < least:
            raise ValueError(f"{name} is {value!r}")
    for name, count, most in (
        ("steps", found.steps, MOST_STEPS),
        ("step", state.step, found.steps),
        ("halvings", found.halvings, _MOST_HALVINGS),
    ):
        if type(count) is not int or not 0 <= count <= most:
            raise ValueError(f"{name} is {count!r}")
    texts = (found.scene, *found.circumstances, *found.circumstances.values())
    if not all(isinstance(one, str) for one in texts):
        raise ValueError("the scene or the circumstances are no texts")
