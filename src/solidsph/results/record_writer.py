"""Writes the record of a run, step by step, so that being killed never costs what was written."""

from __future__ import annotations

import errno
import os
import platform
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from importlib import metadata
from pathlib import Path
from types import TracebackType
from typing import Any

import attrs
import h5py
import numpy as np

from solidsph.errors import DivergedError, RecordError
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.results.digest import BYTES, Reference, step_digest
from solidsph.results.layout import (
    FORMAT,
    HDF5_ERRORS,
    OUTCOME_BYTES,
    RUNNING,
    VTKHDF_VERSION,
    Field,
    PluginUsed,
    padded,
    reason,
    static_fields,
    tag_name,
)
from solidsph.system.files import working_folder
from solidsph.system.signals import uninterrupted

__all__ = ["EarlierStep", "Field", "PluginUsed", "RecordWriter"]

_VERTEX = 1  # VTK's number for a cell of one point
_PAGE = 4096  # bytes; a chunk holds at least about as much
_LARGEST_CHUNK = 2**30  # bytes; HDF5 allows just under 4 GiB
_SPARE = 2**18  # bytes; that much must be free beyond a step's arrays, for HDF5's indices
_AT_ONCE = 2**24  # bytes; room is tried for by so much
_ABANDONED: list[Any] = []  # kept from being closed
# HDF5 1.10 is the first that can be read while it is written; newer formats open in fewer tools.
_FILE_FORMAT = ("v110", "v110")


@attrs.frozen(eq=False)
class EarlierStep:
    """One step of an earlier record, as `RecordWriter.append` takes it."""

    time: float
    step: int
    positions: Array
    fields: Mapping[str, Array]
    history: Mapping[str, float]


class RecordWriter:
    """Writes one run into one HDF5 file, which ParaView opens as it is (see `layout`).

    The file appears at `path` at once, complete but without a step. An older one is replaced when
    the first step is complete; a run that comes to nothing before leaves it.
    When `append` returns, its step has been handed to the operating system: whatever ends the
    process later, the step stays readable with `Record` (a power failure may cost what the system
    had not yet put on the disk). `Record` also reads along while the run goes on. ParaView opens
    the file only after `close`; for the record of a killed run see `repaired`.

    The same arguments and steps give the same bytes: no time of creation is stored.

    Use it as a context manager: an error that leaves the `with` becomes the outcome.

    Args:
        path: where to; missing folders are created.
        particles: reference data of all particles (n in d dimensions), stored completely.
        scene: what was asked for, as TOML text.
        plugins: every part used.
        fields: what each step holds besides the positions.
        columns: unit of each column of the history, by its name.
        overwrite: whether an existing file may be replaced.
        versions: of the software that produced the run; by default what is installed here.
        earlier: steps that the record begins with; they are in the file when it appears.
        notes: what happened to the run, one line each.
        folder: where relative paths in the scene begin; by default the working folder.

    Raises:
        RecordError: the file cannot be created, or the fields do not fit the particles.
    """

    def __init__(
        self,
        path: Path,
        particles: Particles,
        *,
        scene: str,
        plugins: Sequence[PluginUsed],
        fields: Sequence[Field],
        columns: Mapping[str, str],
        overwrite: bool = True,
        versions: Mapping[str, str] | None = None,
        earlier: Iterable[EarlierStep] = (),
        notes: Sequence[str] = (),
        folder: str | None = None,
    ) -> None:
        self.path = Path(os.path.realpath(path))  # through a link to the file itself
        self._particles = particles
        self._fields = {field.name: field for field in fields}
        self._history = np.dtype([(name, np.float64) for name in columns])
        self._count = 0
        self._last_time = -np.inf
        self._assured = 0  # bytes by which the file can grow, as far as is known
        _check_fields(fields, particles)
        self._draft = self.path.with_name(f"{self.path.name}.{os.getpid()}.partial")
        self._is_draft = True
        self._file: Any = None
        reference = Reference(
            particles=particles,
            scene=scene,
            folder=str(working_folder()) if folder is None else folder,
            plugins=plugins,
            fields=fields,
            columns=columns,
            versions=_installed() if versions is None else versions,
            notes=notes,
        )
        try:
            with self._explained_creation():
                check_free(self.path, overwrite)
                self.path.parent.mkdir(parents=True, exist_ok=True)
                _try_room(self._draft, _reference_bytes(particles) + len(scene.encode()) + _SPARE)
                with h5py.File(self._draft, "w", libver=_FILE_FORMAT, locking=False) as file:
                    _write_grid(file, particles, fields)
                    _write_run(file, reference)
                self._open(self._draft)
            for one in earlier:
                self._add(one.time, one.step, one.positions, one.fields, one.history)
            if self._count or not self.path.exists():
                self._publish()
        except BaseException:
            self._give_up()
            raise

    def _explained_creation(self) -> AbstractContextManager[None]:
        remedy = "choose a path in a folder that you may write to"
        return _explained(f"cannot create the record {self.path}", remedy)

    def _publish(self) -> None:
        """The file takes the place of whatever is at `path`."""
        with self._explained_creation():
            self._draft.replace(self.path)
            self._is_draft = False

    def _give_up(self) -> None:
        """Nothing is left behind of a file that nobody has seen yet."""
        if not self._is_draft:
            return
        if self._file is not None:
            file, self._file = self._file, None
            with suppress(*HDF5_ERRORS):
                file.close()
        with suppress(OSError):
            self._draft.unlink()

    @property
    def _place(self) -> Path:
        return self._draft if self._is_draft else self.path

    def _open(self, path: Path) -> None:
        self._file = h5py.File(path, "r+", libver=_FILE_FORMAT, locking=False)
        self._identity = path.stat()
        # From here on HDF5 writes what is pointed at before what points at it.
        self._file.swmr_mode = True
        self._datasets: dict[str, Any] = {}
        self._announced: Any = h5py.h5a.open(self._file["VTKHDF/Steps"].id, b"NSteps")

    @property
    def count(self) -> int:
        """Number of steps written."""
        return self._count

    @property
    def last_time(self) -> float:
        """t of the last step written [s]; minus infinity if there is none."""
        return self._last_time

    def append(
        self,
        time: float,
        step: int,
        positions: Array,
        fields: Mapping[str, Array],
        history: Mapping[str, float],
    ) -> None:
        """Adds one step, all of it or nothing.

        After a failure of the device nothing more can be added; a full disk is noticed before.

        Args:
            time: t [s], later than that of the step before.
            step: number of completed steps of the integrator.
            positions: (n, d) current positions [m].
            fields: every declared field, (n, *components), in its declared unit.
            history: one number for every declared column.

        Raises:
            RecordError: something is missing, unknown or of another shape, or cannot be written.
        """
        if self._file is None:
            raise RecordError(f"the record {self.path} is closed; nothing can be added to it")
        self._check_there()
        self._add(time, step, positions, fields, history)
        if self._is_draft:
            try:
                self._publish()
            except RecordError:
                self._give_up()
                raise

    def _add(
        self,
        time: float,
        step: int,
        positions: Array,
        fields: Mapping[str, Array],
        history: Mapping[str, float],
    ) -> None:
        if not self._last_time < time < np.inf:
            raise RecordError(
                f"a record's times must increase, got {time:.9g} s after {self._last_time:.9g} s; "
                "append each time once"
            )
        _check_names("field", self._fields, fields)
        _check_names("history column", self._history.names or (), history)
        particles, count = self._particles, self._count
        rows = {"Points": self._rows("positions", positions, (particles.dimension,))}
        for name, field in self._fields.items():
            rows[f"PointData/{name}"] = self._rows(name, fields[name], field.components)
        single: dict[str, Any] = {
            "Steps/Values": np.array([time], dtype=np.float64),
            "Steps/PointOffsets": np.array([count * particles.count]),
            "Steps/PartOffsets": None,
            "Steps/NumberOfParts": None,
            "/solidsph/step": np.array([step]),
        }
        row = tuple(float(history[name]) for name in self._history.names or ())
        if row:
            single["/solidsph/history"] = np.array([row], dtype=self._history)
        digest = step_digest(time, step, positions, (fields[name] for name in self._fields), row)
        single["/solidsph/digests"] = np.frombuffer(digest, dtype=np.uint8)[None]

        problem = f"cannot write step {step} to the record {self.path}"
        remedy = f"the {count} steps before it remain; free some space and run again"
        needed = sum(values.nbytes for values in rows.values()) + _SPARE
        with _explained(problem, remedy):
            if shutil.disk_usage(self._place.parent).free < needed:
                raise OSError("the disk is full")
            self._assure(needed)
        with uninterrupted(), _explained(problem, remedy), self._abandoned_on_failure():
            for name, values in rows.items():
                self._extend(name, count * particles.count, particles.count, values)
            for name, value in single.items():
                self._extend(name, count, 1, value)
            # All of the step reaches the file before the number that announces it.
            self._file.flush()
            self._announced.write(np.array(count + 1))
            self._file.flush()
        self._count, self._last_time = count + 1, time

    def close(self, outcome: str = "finished") -> None:
        """Ends the record with a word on how the run ended; a second call changes nothing.

        Raises:
            RecordError: the file cannot be completed; the steps that it holds remain.
        """
        if self._file is None:
            return
        self._check_there()
        remedy = f"the {self._count} steps in it remain"
        with uninterrupted(), _explained(f"cannot complete the record {self.path}", remedy):
            with self._abandoned_on_failure():
                self._end_with(outcome)
                self._file.flush()
            file, self._file = self._file, None
            file.close()
        if self._is_draft:
            # A run that came to nothing leaves what an earlier one has recorded.
            if outcome == "finished" or not self.path.exists():
                self._publish()
            else:
                self._give_up()

    def _check_there(self) -> None:
        """That the file is still where it was made: others may have removed or replaced it."""
        try:
            there = os.path.samestat(self._identity, self._place.stat())
            what = "replaced by another file"
        except OSError:
            there, what = False, "removed"
        if there:
            return
        file, self._file = self._file, None
        with suppress(*HDF5_ERRORS):
            file.close()
        self._is_draft = False  # there is nothing to remove
        raise RecordError(
            f"the record {self._place} was {what} while the run wrote it, and its {self._count} "
            "steps are lost; run the scene again, and leave the file alone until the run has ended"
        )

    def __enter__(self) -> RecordWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
            return
        if isinstance(error, DivergedError):
            outcome = f"diverged: {error}"
        else:
            outcome = f"stopped: {type(error).__name__}: {error}".rstrip(": ")
        with suppress(RecordError):  # the error that stopped the run is the one to be told
            self.close(outcome)

    def _assure(self, needed: int) -> None:
        """That the file can grow by so much; tried for many steps at once, since it takes time."""
        self._assured -= needed
        if self._assured >= 0:
            return
        path = self._place
        try:
            _try_room(path, max(needed, _AT_ONCE))
            self._assured = max(needed, _AT_ONCE) - needed
        except OSError:
            _try_room(path, needed)
            self._assured = 0

    def _end_with(self, outcome: str) -> None:
        text = outcome.encode(errors="replace")[:OUTCOME_BYTES]
        self._file["solidsph/outcome"][()] = text

    @contextmanager
    def _abandoned_on_failure(self) -> Iterator[None]:
        """After a failure nothing more is written, and the file is not even closed.

        HDF5 forgets what it failed to write, so a later step could be announced with holes in it;
        and closing would fail in turn, which can crash the process (h5py issue 914).
        """
        try:
            yield
        except HDF5_ERRORS:
            with suppress(*HDF5_ERRORS):
                self._end_with("stopped: a step could not be written")
            _ABANDONED.append((self._file, self._datasets, self._announced))
            self._file = None
            self._give_up()
            raise

    def _extend(self, name: str, first: int, count: int, rows: Any) -> None:
        """Adds rows to a dataset; without any the fill value says it."""
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
        """Checked and padded."""
        array = np.asarray(values, dtype=np.float64)
        shape = (self._particles.count, *components)
        if array.shape != shape:
            raise RecordError(f"field {name!r} must have shape {shape}, got {array.shape}")
        return np.ascontiguousarray(padded(array, components))


@contextmanager
def _explained(problem: str, remedy: str) -> Iterator[None]:
    """One message of ours in place of what the file system or HDF5 has to say."""
    try:
        yield
    except HDF5_ERRORS as error:
        raise RecordError(f"{problem}: {reason(error)}; {remedy}") from None


def _try_room(path: Path, size: int) -> None:
    """That a file can grow by so much, found out without HDF5, which a failed write would hurt.

    Raises:
        OSError: the device is full, or a quota or a limit does not allow it.
    """
    if not hasattr(os, "posix_fallocate"):
        return
    with path.open("ab") as file:
        end = os.fstat(file.fileno()).st_size
        try:
            os.posix_fallocate(file.fileno(), end, size)
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
                raise
        finally:
            os.ftruncate(file.fileno(), end)


def _reference_bytes(particles: Particles) -> int:
    """What the particles take in a file, before any step."""
    cells, tags, vector = 17, len(particles.tags), 24
    each = cells + tags + 3 * vector + 3 * 8 + 5
    faces = sum(
        face.particles.nbytes + face.area_vectors.nbytes + face.areas.nbytes
        for face in particles.faces.values()
    )
    return each * particles.count + faces


def check_free(path: Path, overwrite: bool) -> None:
    """That a record may be written to `path`, maybe in place of a file that is there.

    Raises:
        RecordError: it may not.
    """
    if path.is_dir():
        example = path / "result.vtkhdf"
        raise RecordError(f"{path} is a folder, not a file; write to {example} for example")
    if not path.exists():
        return
    if not path.is_file():
        raise RecordError(f"{path} is not a regular file and is not replaced; choose another path")
    if not overwrite:
        raise RecordError(f"{path} exists already; choose another path or allow to overwrite it")
    # A new file could take its place, but its owner has said that it stays.
    with _explained(f"{path} may not be replaced", "choose another path or make it writable"):
        path.open("r+b").close()


def _check_fields(fields: Sequence[Field], particles: Particles) -> None:
    d = particles.dimension
    taken = {field.name for field in static_fields(d)} | {tag_name(tag) for tag in particles.tags}
    for field in fields:
        if field.name in taken or not field.name.strip(".") or "/" in field.name:
            raise RecordError(
                f"a record cannot hold a field called {field.name!r}: the name is taken or no name "
                "for HDF5; choose another"
            )
        taken.add(field.name)
        if field.components not in ((), (d,), (d, d)):
            raise RecordError(
                f"field {field.name!r} has components {field.components}; in {d} dimensions they "
                f"are () for a scalar, ({d},) for a vector or ({d}, {d}) for a tensor"
            )


def _check_names(kind: str, declared: Sequence[str] | Mapping[str, Field], given: Any) -> None:
    missing = [name for name in declared if name not in given]
    unknown = [name for name in given if name not in declared]
    if missing or unknown:
        raise RecordError(
            f"each step needs every {kind} that was declared and no other; "
            f"missing: {', '.join(missing) or 'none'}, not declared: {', '.join(unknown) or 'none'}"
        )


def _write_grid(file: Any, particles: Particles, fields: Sequence[Field]) -> None:
    """All that VTK sees, with room for steps but without one."""
    n = particles.count
    grid = file.create_group("VTKHDF")
    grid.attrs["Version"] = np.array(VTKHDF_VERSION)
    grid.attrs["Type"] = np.bytes_("UnstructuredGrid")
    for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
        grid[name] = np.array([n])
    grid["Connectivity"] = np.arange(n)
    grid["Offsets"] = np.arange(n + 1)
    grid["Types"] = np.full(n, _VERTEX, dtype=np.uint8)

    steps = grid.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(0)
    _extendable(steps, "Values", np.float64).attrs["units"] = _text(["s"]).reshape(())
    # The first row of a step: i n in what evolves, 0 in what all steps share. One dataset under
    # many names does for each; the zeros, like the single part a step has, are never written.
    moving = _extendable(steps, "PointOffsets", np.int64)
    shared = _extendable(steps, "PartOffsets", np.int64)
    _extendable(steps, "NumberOfParts", np.int64, fill=1)
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = shared

    data, offsets = grid.create_group("PointData"), steps.create_group("PointDataOffsets")
    _evolving(grid, Field("Points", (particles.dimension,), "m"), n)
    for field in fields:
        _evolving(data, field, n)
        offsets[field.name] = moving
    values = _static_values(particles)
    for field in static_fields(particles.dimension):
        _static(data, field, values[field.name])
        offsets[field.name] = shared
    for tag, mask in particles.tags.items():
        _static(data, Field(tag_name(tag), (), "-"), mask.astype(np.uint8))
        offsets[tag_name(tag)] = shared


def _static_values(particles: Particles) -> dict[str, Any]:
    body = np.full(particles.count, -1, dtype=np.int32)
    for number, rows in enumerate(particles.bodies.values()):
        body[rows] = number
    return {
        "reference_position": particles.positions,
        "volume": particles.volumes,
        "cell": particles.cells,
        "spacing": particles.spacings,
        "area_vector": particles.area_vectors,
        "ghost": particles.ghosts.astype(np.uint8),
        "image": particles.images,
        "body": body,
    }


def _write_run(file: Any, reference: Reference) -> None:
    """All that VTK does not see."""
    particles, plugins, columns = reference.particles, reference.plugins, reference.columns
    n = particles.count
    run = file.create_group("solidsph")
    run.attrs["format"] = FORMAT
    run.attrs["dimension"] = particles.dimension
    run.attrs["folder"] = _text([reference.folder]).reshape(())
    run.attrs["digest"] = _text([reference.digest().hex()]).reshape(())
    if reference.notes:
        run.attrs["notes"] = _text(reference.notes)
    run["scene"] = _text([reference.scene]).reshape(())
    names = [column.name for column in attrs.fields(PluginUsed)]
    texts = {name: _text([getattr(plugin, name) for plugin in plugins]) for name in names}
    table = np.empty(len(plugins), dtype=[(name, text.dtype) for name, text in texts.items()])
    for name, text in texts.items():
        table[name] = text
    run["plugins"] = table
    run["versions"] = _text([f"{name} {version}" for name, version in reference.versions.items()])
    run["fields"] = _text([field.name for field in reference.fields])
    run["tags"] = _text(list(particles.tags))
    run["bodies"] = _text(list(particles.bodies))
    ranges = [rows.indices(n)[:2] for rows in particles.bodies.values()]
    run["body_ranges"] = np.array(ranges, dtype=np.int64).reshape(-1, 2)
    for number, (name, face) in enumerate(particles.faces.items()):
        group = run.create_group(f"faces/{number}")
        group.attrs["name"] = _text([name]).reshape(())
        group["particles"] = np.asarray(face.particles, dtype=np.int64)
        group["area_vectors"] = face.area_vectors
        group["areas"] = face.areas
    room = h5py.string_dtype("utf-8", OUTCOME_BYTES)
    run.create_dataset("outcome", data=RUNNING.encode(), dtype=room)
    _extendable(run, "step", np.int64)
    run.create_dataset(
        "digests",
        shape=(0, BYTES),
        maxshape=(None, BYTES),
        chunks=(_PAGE // BYTES, BYTES),
        dtype=np.uint8,
    )
    if columns:
        history = _extendable(run, "history", [(name, np.float64) for name in columns])
        history.attrs["units"] = _text(list(columns.values()))


def _installed() -> dict[str, str]:
    names = ("solidsph", "numpy", "scipy", "h5py")
    versions = {name: metadata.version(name) for name in names}
    return {**versions, "hdf5": h5py.version.hdf5_version, "python": platform.python_version()}


def _text(lines: Sequence[str]) -> Any:
    """Lines in one array; of fixed length, since damage to a reference could cost the reader."""
    encoded = [line.encode(errors="replace") for line in lines]
    longest = max((len(line) for line in encoded), default=0)
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", max(1, longest)))


def _extendable(group: Any, name: str, kind: Any, fill: object = None) -> Any:
    """A dataset of one row a step."""
    rows = max(1, _PAGE // np.dtype(kind).itemsize)
    return group.create_dataset(
        name, shape=(0,), maxshape=(None,), chunks=(rows,), dtype=kind, fillvalue=fill
    )


def _evolving(group: Any, field: Field, count: int) -> None:
    """A dataset of n rows a step."""
    width = (3 ** len(field.components),) if field.components else ()
    row_bytes = 8 * (width[0] if width else 1)
    # One step a chunk, so that it is read and written in one piece; small steps share a chunk.
    # Nothing is compressed, so part of a chunk costs no more than that part.
    rows = max(1, count) * max(1, _PAGE // (row_bytes * max(1, count)))
    rows = min(rows, _LARGEST_CHUNK // row_bytes)
    dataset = group.create_dataset(
        field.name,
        shape=(0, *width),
        maxshape=(None, *width),
        chunks=(rows, *width),
        dtype=np.float64,
        fillvalue=np.nan,  # never seen, and evident if it were
    )
    _describe(dataset, field)


def _static(group: Any, field: Field, values: Any) -> None:
    _describe(group.create_dataset(field.name, data=padded(values, field.components)), field)


def _describe(dataset: Any, field: Field) -> None:
    dataset.attrs["units"] = _text([field.unit]).reshape(())
    dataset.attrs["components"] = np.array(field.components, dtype=np.int64)
