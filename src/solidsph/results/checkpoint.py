"""Checkpoint: a complete state in a file of its own, from which a run goes on bit for bit.

The file begins with a line of text, `solidsph checkpoint FORMAT DIGEST`; an npz file of NumPy
follows. The digest is of all that follows the line, so that no damage goes unnoticed, and nothing
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
from solidsph.results.layout import HDF5_ERRORS
from solidsph.results.record_file import explained
from solidsph.scene.scene_data import MOST_STEPS
from solidsph.system.files import content
from solidsph.system.signals import uninterrupted

FORMAT = 1
_MAGIC = "solidsph checkpoint"
_LONGEST_HEAD = 200  # bytes
_ARRAYS = ("positions", "velocities", "accelerations")
_NAMED = ("memory", "applied")
_OF_STATE = ("time", "step", "work")
_OF_RUN = ("scene", "step_size", "steps", "halvings")

# Errors in reading an npz file; if its digest is right, only a fault of ours can cause them.
_NPZ_ERRORS = (*HDF5_ERRORS, zipfile.BadZipFile)

_MOST_HALVINGS = 60  # of a step: beyond, adding a step to a time would not change it

START_OVER = (
    "delete it and resume again: the run then starts from its first state, and what is recorded "
    "stays"
)
"""Remedy where a checkpoint is of no use."""


@attrs.frozen(eq=False)
class Checkpoint:
    """All that a run needs to go on from one of its outputs."""

    state: State
    scene: str  # as in the record
    step_size: float  # [s]
    steps: int  # of the whole run
    halvings: int  # of the step that the scene asks for
    environment: Mapping[str, str]
    kept: Mapping[str, Array]  # arrays of observers (`solidsph_keep`)


def checkpoint_path(record: Path) -> Path:
    """Path of the checkpoint of a record: beside the file itself, where `record` is a link."""
    real = Path(os.path.realpath(record))
    # Records of two suffixes may have one stem.
    return real.with_name(f"{real.stem if real.suffix == '.h5' else real.name}.checkpoint")


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a whole checkpoint to the disk; if that fails, RecordError, and an older one stays."""
    body = _packed(checkpoint)
    head = f"{_MAGIC} {FORMAT} {_digest(body)}\n".encode()
    draft = path.with_name(f"{path.name}.{os.getpid()}.partial")
    remedy = (
        "the record and any earlier checkpoint are as they were: free some space or choose another "
        "folder, then resume"
    )
    try:
        with uninterrupted(), explained(f"cannot write the checkpoint {path}", remedy):
            path.parent.mkdir(parents=True, exist_ok=True)
            with draft.open("wb") as file:
                file.write(head)
                file.write(body)
                file.flush()
                os.fsync(file.fileno())
            draft.replace(path)
    finally:
        with suppress(OSError):  # after a success there is no draft any more
            draft.unlink()


def read_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint; RecordError if there is none, or it is damaged or of another format."""
    with explained(f"the checkpoint {path} cannot be read", "check the path"):
        data = content(path, sys.maxsize)
    head, end, body = data[:_LONGEST_HEAD].partition(b"\n")
    words = head.decode("ascii", errors="replace").removeprefix(_MAGIC).split()
    if not (end and head.startswith(_MAGIC.encode()) and len(words) == 2 and words[0].isdecimal()):
        raise RecordError(f"{path} is not a checkpoint of solidsph, or its beginning is lost")
    if words[0] != str(FORMAT):
        number = words[0][:9]  # one of any length would take long to convert
        raise RecordError(
            f"the checkpoint {path} has format {number}, this solidsph reads {FORMAT}; "
            f"{'update solidsph' if int(number) > FORMAT else START_OVER}"
        )
    body = data[len(head) + 1 :]
    damaged = f"the checkpoint {path} is damaged; {START_OVER}"
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
        **{name: getattr(state, name) for name in _OF_STATE},
        **{name: getattr(checkpoint, name) for name in _OF_RUN},
        "names": {group: list(values) for group, values in named.items()},
        "circumstances": checkpoint.environment,
    }
    # JSON gives every finite double back, and has words for NaN and infinities that it reads.
    text = np.frombuffer(json.dumps(facts, default=dict).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, facts=text, **arrays)
    return file.getvalue()


def _unpacked(body: bytes) -> Checkpoint:
    with zipfile.ZipFile(io.BytesIO(body)) as parts:
        if sum(part.file_size for part in parts.infolist()) > len(body):
            raise ValueError("it claims more bytes than it has")
    with np.load(io.BytesIO(body), allow_pickle=False) as data:
        arrays: dict[str, Any] = {name: data[name] for name in data.files}
    facts = json.loads(bytes(arrays.pop("facts")))
    named: dict[str, Any] = {
        group: {name: arrays[f"{group} {number}"] for number, name in enumerate(names)}
        for group, names in facts["names"].items()
    }
    checkpoint = Checkpoint(
        state=State(
            **{name: facts[name] for name in _OF_STATE},
            **{name: arrays[name] for name in _ARRAYS},
            **{name: named[name] for name in _NAMED},
        ),
        **{name: facts[name] for name in _OF_RUN},
        environment=facts["circumstances"],
        kept=named["kept"],
    )
    _check(checkpoint)
    return checkpoint


def _check(checkpoint: Checkpoint) -> None:
    """Raise ValueError for types or sizes that no run leaves: a digest shows only a whole file."""
    state = checkpoint.state
    shape = state.positions.shape
    moving = {name: getattr(state, name) for name in _ARRAYS}
    for name, array in (*moving.items(), *state.applied.items()):
        if array.dtype != np.float64 or array.ndim != 2 or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} of shape {array.shape}, not of {shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} is not finite")
    for name, array in (*state.memory.items(), *checkpoint.kept.items()):
        if array.dtype.kind not in "fiub":
            raise ValueError(f"{name} holds {array.dtype}, which are no numbers")
    for name, value, least in (
        *(("time", state.time, 0.0), ("step size", checkpoint.step_size, 5e-324)),
        *((name, value, -np.inf) for name, value in state.work.items()),
    ):
        if not isinstance(value, float) or not np.isfinite(value) or value < least:
            raise ValueError(f"{name} is {value!r}")
    for name, count, most in (
        ("steps", checkpoint.steps, MOST_STEPS),
        ("step", state.step, checkpoint.steps),
        ("halvings", checkpoint.halvings, _MOST_HALVINGS),
    ):
        if type(count) is not int or not 0 <= count <= most:
            raise ValueError(f"{name} is {count!r}")
    texts = (checkpoint.scene, *checkpoint.environment, *checkpoint.environment.values())
    if not all(isinstance(text, str) for text in texts):
        raise ValueError("the scene or the environment is no text")
