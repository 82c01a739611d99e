"""Writes the record of a run, step by step; a process that is killed loses no finished step."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

import attrs
import h5py
import numpy as np

from solidsph.errors import DivergedError, RecordError
from solidsph.maths.arrays import Array
from solidsph.results.contents import Output, Reference
from solidsph.results.empty_record import check_fields, reference_bytes, write_empty_record
from solidsph.results.layout import HDF5_ERRORS, OUTCOME_BYTES, Field, padded
from solidsph.results.record_file import check_space, check_writable, explained
from solidsph.run.outcome import FINISHED
from solidsph.system.signals import uninterrupted

_SPARE = 2**18  # bytes that must be free beyond a step's arrays, for HDF5's indices
_AT_ONCE = 2**24  # bytes of space that are checked at once
_ABANDONED: list[Any] = []  # kept from being closed
# HDF5 1.10 is the first that can be read while it is written; newer formats open in fewer tools.
_FILE_FORMAT = ("v110", "v110")


class RecordWriter:
    """Writes one run into one HDF5 file, which ParaView opens as it is (see `layout`).

    The file is a draft until its first step is complete; then it appears at `path`, in place of an
    older one. A run that ends before leaves the older one.
    When `append` returns, its step has been handed to the operating system: however the process
    ends later, the step stays readable with `Record` (a power failure may lose what the system had
    not yet put on the disk). `Record` also reads while the run goes on. ParaView opens the file
    only after `close`; for the record of a killed run see `repaired`.

    The same arguments and steps give the same bytes: no time of creation is stored.

    Use it as a context manager: an error that leaves the `with` becomes the outcome.

    Attributes:
        path: the file, through a link to it.
        count: number of steps written.
        last_time: t of the last step written [s]; minus infinity if there is none.

    Args:
        path: the file; missing folders are created.
        reference: what all steps share, stored completely (n particles in d dimensions).
        overwrite: whether an existing file may be replaced.
        earlier: steps that the record begins with; they are in the file when it appears.

    Raises:
        RecordError: the file cannot be created, or the fields do not fit the particles.
    """

    def __init__(
        self,
        path: Path,
        reference: Reference,
        *,
        overwrite: bool = True,
        earlier: Iterable[Output] = (),
    ) -> None:
        self.path = Path(os.path.realpath(path))
        self._particles = reference.particles
        self._fields = {field.name: field for field in reference.fields}
        self._history = np.dtype([(name, np.float64) for name in reference.columns])
        self.count = 0
        self.last_time = -np.inf
        self._checked_space = 0  # bytes by which the file can grow, as far as is known
        check_fields(reference.fields, reference.particles)
        self._draft = self.path.with_name(f"{self.path.name}.{os.getpid()}.partial")
        self._is_draft = True
        self._file: Any = None
        try:
            with self._explained_creation():
                check_writable(self.path, overwrite=overwrite)
                self.path.parent.mkdir(parents=True, exist_ok=True)
                check_space(self._draft, reference_bytes(reference) + _SPARE)
                with h5py.File(self._draft, "w", libver=_FILE_FORMAT, locking=False) as file:
                    write_empty_record(file, reference)
                self._open()
            for output in earlier:
                self._add(output)
            if self.count or not self.path.exists():
                self._publish()
        except BaseException:
            self._discard_draft()
            raise

    def _explained_creation(self) -> AbstractContextManager[None]:
        remedy = "choose a path in a folder that you may write to"
        return explained(f"cannot create the record {self.path}", remedy)

    def _open(self) -> None:
        self._file = h5py.File(self._draft, "r+", libver=_FILE_FORMAT, locking=False)
        self._identity = self._draft.stat()
        # From here on HDF5 writes what is pointed at before what points at it.
        self._file.swmr_mode = True
        self._datasets: dict[str, Any] = {}
        self._step_count: Any = h5py.h5a.open(self._file["VTKHDF/Steps"].id, b"NSteps")

    def _publish(self) -> None:
        """Put the file in place of whatever is at `path`."""
        with self._explained_creation():
            self._draft.replace(self.path)
            self._is_draft = False

    def _discard_draft(self) -> None:
        """Close and remove a file that is not published; do nothing to a published one."""
        if not self._is_draft:
            return
        self._close_file()
        with suppress(OSError):
            self._draft.unlink()

    def _close_file(self) -> None:
        file, self._file = self._file, None
        with suppress(*HDF5_ERRORS):
            if file is not None:
                file.close()

    @property
    def _place(self) -> Path:
        return self._draft if self._is_draft else self.path

    def append(self, output: Output) -> None:
        """Add one step, all of it or nothing.

        Its time must be later than that of the step before, and it must have every declared field
        and column. A full disk is noticed before anything is written; after a failure of the device
        no more steps can be added.

        Raises:
            RecordError: something is missing, unknown or of another shape, or cannot be written.
        """
        if self._file is None:
            raise RecordError(f"the record {self.path} is closed; nothing can be added to it")
        self._check_identity()
        self._add(output)
        if self._is_draft:
            try:
                self._publish()
            except RecordError:
                self._discard_draft()
                raise

    def _add(self, output: Output) -> None:
        time, step, count, n = output.time, output.step, self.count, self._particles.count
        if not self.last_time < time < np.inf:
            raise RecordError(
                f"a record's times must increase, got {time:.9g} s after {self.last_time:.9g} s; "
                "append each time once"
            )
        columns = self._history.names or ()
        _check_names("field", self._fields, output.fields)
        _check_names("history column", columns, output.history)
        positions = self._rows("positions", output.positions, (self._particles.dimension,))
        rows = {"Points": positions} | {
            f"PointData/{name}": self._rows(name, output.fields[name], field.components)
            for name, field in self._fields.items()
        }
        single: dict[str, Any] = {
            "Steps/Values": np.array([time], dtype=np.float64),
            "Steps/PointOffsets": np.array([count * n]),
            "Steps/PartOffsets": None,
            "Steps/NumberOfParts": None,
            "/solidsph/step": np.array([step]),
        }
        history = {name: float(output.history[name]) for name in columns}
        if history:
            single["/solidsph/history"] = np.array([(*history.values(),)], dtype=self._history)
        fields = {name: output.fields[name] for name in self._fields}
        digest = attrs.evolve(output, fields=fields, history=history).digest()
        single["/solidsph/digests"] = np.frombuffer(digest, dtype=np.uint8)[None]

        problem = f"cannot write step {step} to the record {self.path}"
        remedy = f"the {count} steps before it remain; free some space and run again"
        needed = sum(values.nbytes for values in rows.values()) + _SPARE
        with explained(problem, remedy):
            if shutil.disk_usage(self._place.parent).free < needed:
                raise OSError("the disk is full")
            self._check_space(needed)
        with uninterrupted(), explained(problem, remedy), self._abandoned_on_failure():
            for name, values in rows.items():
                self._extend(name, count * n, n, values)
            for name, value in single.items():
                self._extend(name, count, 1, value)
            # All of the step reaches the file before the number of steps counts it.
            self._file.flush()
            self._step_count.write(np.array(count + 1))
            self._file.flush()
        self.count, self.last_time = count + 1, time

    def close(self, outcome: str = FINISHED) -> None:
        """End the record with its outcome; a second call changes nothing.

        Raises:
            RecordError: the file cannot be completed; the steps that it holds remain.
        """
        if self._file is None:
            return
        self._check_identity()
        remedy = f"the {self.count} steps in it remain"
        with uninterrupted(), explained(f"cannot complete the record {self.path}", remedy):
            with self._abandoned_on_failure():
                self._write_outcome(outcome)
                self._file.flush()
            file, self._file = self._file, None
            file.close()
        if self._is_draft:
            # A run that has no step leaves what an earlier one has recorded.
            if outcome == FINISHED or not self.path.exists():
                self._publish()
            else:
                self._discard_draft()

    def __enter__(self) -> RecordWriter:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            self.close()
            return
        if isinstance(error, DivergedError):
            outcome = f"diverged: {error}"
        else:
            outcome = f"stopped: {type(error).__name__}: {error}".rstrip(": ")
        with suppress(RecordError):  # the error that stopped the run is the one to report
            self.close(outcome)

    def _check_identity(self) -> None:
        """Check that the file is still at its place: others may have removed or replaced it."""
        try:
            is_same = os.path.samestat(self._identity, self._place.stat())
            what = "replaced by another file"
        except OSError:
            is_same, what = False, "removed"
        if is_same:
            return
        self._close_file()
        self._is_draft = False  # there is nothing to remove
        raise RecordError(
            f"the record {self.path} was {what} while the run wrote it, and its {self.count} "
            "steps are lost; run the scene again, and leave the file alone until the run has ended"
        )

    def _check_space(self, needed: int) -> None:
        """Check that the file can grow by `needed` bytes; for many steps at once, to save time."""
        self._checked_space -= needed
        if self._checked_space >= 0:
            return
        try:
            check_space(self._place, max(needed, _AT_ONCE))
            self._checked_space = max(needed, _AT_ONCE) - needed
        except OSError:
            check_space(self._place, needed)
            self._checked_space = 0

    def _write_outcome(self, outcome: str) -> None:
        self._file["solidsph/outcome"][()] = outcome.encode(errors="replace")[:OUTCOME_BYTES]

    @contextmanager
    def _abandoned_on_failure(self) -> Iterator[None]:
        """After a failure write nothing more, and do not even close the file.

        HDF5 forgets what it failed to write, so a later step could be counted with holes in it;
        and closing would fail in turn, which can crash the process (h5py issue 914).
        """
        try:
            yield
        except HDF5_ERRORS:
            with suppress(*HDF5_ERRORS):
                self._write_outcome("stopped: a step could not be written")
            _ABANDONED.append((self._file, self._datasets, self._step_count))
            self._file = None
            self._discard_draft()
            raise

    def _extend(self, name: str, first: int, count: int, rows: Any) -> None:
        """Add rows to a dataset; if they are None, its fill value stands for them."""
        # Slicing h5py's Dataset would take ten times as long, and small runs would notice.
        if name not in self._datasets:
            self._datasets[name] = self._file["VTKHDF"][name].id
        dataset = self._datasets[name]
        dataset.set_extent((first + count, *dataset.shape[1:]))
        if rows is not None:
            memory, place = h5py.h5s.create_simple(rows.shape), dataset.get_space()
            place.select_hyperslab((first,) + (0,) * (rows.ndim - 1), rows.shape)
            dataset.write(memory, place, rows)

    def _rows(self, name: str, values: Array, components: tuple[int, ...]) -> Array:
        """Check the shape of one array, and pad it."""
        array = np.asarray(values, dtype=np.float64)
        shape = (self._particles.count, *components)
        if array.shape != shape:
            raise RecordError(f"field {name!r} must have shape {shape}, got {array.shape}")
        return np.ascontiguousarray(padded(array, components))


def _check_names(kind: str, declared: Sequence[str] | Mapping[str, Field], given: Any) -> None:
    missing = [name for name in declared if name not in given]
    unknown = [name for name in given if name not in declared]
    if missing or unknown:
        raise RecordError(
            f"each step needs every {kind} that was declared and no other; "
            f"missing: {', '.join(missing) or 'none'}, not declared: {', '.join(unknown) or 'none'}"
        )
