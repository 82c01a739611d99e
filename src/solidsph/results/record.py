"""Reads the record of a run: finished, still running, or killed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.model.particles import Face, Particles
from solidsph.results.contents import Output, Reference
from solidsph.results.error_bars import read_error_bars
from solidsph.results.hdf5_source import SIGNATURE, HDF5Source, is_unclosed
from solidsph.results.layout import (
    FORMAT,
    HDF5_ERRORS,
    PARTICLE_ARRAYS,
    Field,
    PluginUsed,
    reason,
    static_fields,
    tag_name,
    unpadded,
)
from solidsph.results.layout_checks import Tree, check_first, check_rest, check_values
from solidsph.results.time_series import TimeSeries

if TYPE_CHECKING:
    from solidsph.probes.values import Values

T = TypeVar("T")

# While the run goes on, a block of the file may be read half written, or the file be replaced.
_ATTEMPTS = 4
_PAUSE = 0.02  # s


class NotARecordError(RecordError):
    """The file is something else."""


class Record:
    """One run, read from its file. Small data are read at once, arrays over time when asked for.

    It shows the steps that were complete when it was opened; while a run goes on, open its record
    again to see more. Use it as a context manager, or `close` it.

    Attributes:
        path: the file.
        times: (steps,) t [s].
        steps: (steps,) number of completed steps of the integrator at each time.
        dimension: number of space dimensions d.
        particles: reference data of all particles.
        positions: (steps, n, d) current positions [m], lazily.
        field_names: the fields that each step holds.
        units: unit of each field, by its name.
        history: column -> (steps,) values.
        history_units: unit of each column.
        error_bars: numbers of the history with their estimated errors, by quantity, of a run whose
            accuracy was asked for.
        scene: what was asked for, as TOML text.
        plugins: every part used.
        versions: of the software that produced the run, by its name.
        notes: what happened to the run: that it was extended, or rolled back.
        folder: where relative paths in the scene begin.
        outcome: "finished", "diverged: ...", "stopped: ..."; "running" if it runs or was killed.
        is_closed_by_writer: False while the run goes on, and for ever if it was killed.

    Raises:
        RecordError: there is no such file, it is no record, or it is damaged.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._file: Any = None
        self._source: HDF5Source | None = None
        self._is_complete = False
        self._with_retries(self._open)
        self._is_complete = True

    def _open(self) -> None:
        self.close()
        self.is_closed_by_writer = not is_unclosed(_head(self.path))
        try:
            # Not by its name: HDF5 does not open a file twice in one process in different ways, so
            # this reader and a user's own `h5py.File` would keep each other out.
            self._source = HDF5Source(self.path)
            self._file = h5py.File(self._source, "r")
            self._read_all()
        except BaseException:
            self.close()
            raise

    def _read_all(self) -> None:
        run = _run(self._file, self.path)
        written = int(run.attrs["format"])
        if written != FORMAT:  # older formats were never published, so none is translated
            remedy = "update solidsph" if written > FORMAT else "run its scene again"
            raise RecordError(
                f"the record {self.path} has format {written}, this solidsph reads {FORMAT}; "
                f"{remedy}"
            )
        tree = Tree(self._file)
        check_first(tree)
        grid = self._file["VTKHDF"]
        announced = int(grid["Steps"].attrs["NSteps"])  # first, since the run goes on meanwhile
        self.dimension = int(run.attrs["dimension"])
        self.scene = bytes(run["scene"][()]).decode()
        self.plugins = tuple(
            PluginUsed(*(text.decode() for text in row)) for row in run["plugins"][()]
        )
        self.versions = dict(line.rsplit(" ", 1) for line in _lines(run, "versions"))
        self.notes = tuple(line.decode() for line in run.attrs.get("notes", ()))
        self.outcome = bytes(run["outcome"][()]).decode(errors="ignore")
        self.folder = _word(run, "folder")
        self.field_names = _lines(run, "fields")
        check_rest(tree, announced, self.field_names, _lines(run, "tags"))
        self.particles = self._particles(run, grid["PointData"])
        sets = {name: grid["PointData"][name] for name in self.field_names}
        self.units = {name: _word(dataset, "units") for name, dataset in sets.items()}

        count = self._readable(announced, [grid["Points"], *sets.values()])
        self.times: Array = _first(grid["Steps/Values"], count)
        self.steps: NDArray[np.int64] = _first(run["step"], count)
        self.positions = self._series(grid["Points"], count)
        self._fields = {name: self._series(dataset, count) for name, dataset in sets.items()}
        table = run.get("history")
        names = table.dtype.names if table is not None else ()
        self.history: Mapping[str, Array] = MappingProxyType(
            {name: np.ascontiguousarray(_first(table, count)[name]) for name in names}
        )
        units = table.attrs["units"] if table is not None else ()
        self.history_units = {name: unit.decode() for name, unit in zip(names, units, strict=True)}
        self.error_bars = MappingProxyType(read_error_bars(self._file))
        check_values(self.particles, self.times, self.steps)
        if self.reference.digest().hex() != _word(run, "digest"):
            raise ValueError("the particles or the scene in it are not those that were written")

    @property
    def reference(self) -> Reference:
        """Data that all steps share, as `RecordWriter` takes them."""
        return Reference(
            particles=self.particles,
            scene=self.scene,
            folder=self.folder,
            plugins=self.plugins,
            fields=[
                Field(name, series.shape[2:], series.unit) for name, series in self._fields.items()
            ],
            columns=self.history_units,
            versions=self.versions,
            notes=self.notes,
        )

    def output(self, place: int) -> Output:
        """All of one step, as `RecordWriter` takes it."""
        return Output(
            time=float(self.times[place]),
            step=int(self.steps[place]),
            positions=self.positions[place],
            fields={name: series[place] for name, series in self._fields.items()},
            history={name: float(values[place]) for name, values in self.history.items()},
        )

    def checked_output(self, place: int) -> Output:
        """All of one step; RecordError unless it is what was written, to the last bit."""
        output = self.output(place)
        digests = self._file["solidsph/digests"]
        written: NDArray[np.uint8] = self._with_retries(lambda: digests[place])
        if output.digest() != written.tobytes():
            raise RecordError(
                f"the record {self.path} is damaged: its output at t = {output.time:.9g} s "
                "is not what was written; run its scene again, into another record"
            )
        return output

    def field(self, name: str) -> TimeSeries:
        """The named field over time: (steps, n, *components), lazily.

        Raises:
            RecordError: the record has no such field.
        """
        if name not in self._fields:
            near = get_close_matches(name, self.field_names, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            known = ", ".join(self.field_names) or "none"
            raise RecordError(f"no field {name!r} in {self.path}; {hint}fields: {known}")
        return self._fields[name]

    def at(self, points: ArrayLike, output: int = -1, *, body: str | None = None) -> Values:
        """Displacement, velocity, F and stress at any points of the undeformed bodies.

        By interpolation of the second order up to the surface, as `Result.at` gives them.

        Args:
            points: reference positions, (m, d) or (d,) [m].
            output: the output, from the end if negative.
            body: the body, where several touch; the one in which a point is deepest if None.

        Raises:
            SceneError: a point lies outside of every body.
            RecordError: the shapes of the bodies cannot be made from the scene in the record.
            IndexError: there is no such output.
        """
        from solidsph.probes.values import values_at  # loaded only when asked for
        from solidsph.results.recorded_shapes import recorded_shapes

        stress = self.field("cauchy_stress")[output]
        return values_at(
            recorded_shapes(self.scene, self.folder),
            self.particles,
            points,
            body,
            positions=self.positions[output],
            velocities=self.field("velocity")[output],
            stress=lambda chosen: stress[chosen],
        )

    @property
    def count(self) -> int:
        """Number of steps."""
        return len(self.times)

    def close(self) -> None:
        """Release the file. Data that were read stay; nothing more can be read."""
        file, self._file = self._file, None
        source, self._source = self._source, None
        if file is not None:
            file.close()
        if source is not None:
            source.close()

    def __enter__(self) -> Record:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _particles(self, run: Any, data: Any) -> Particles:
        arrays: dict[str, Any] = {
            PARTICLE_ARRAYS[field.name]: unpadded(data[field.name][()], field.components)
            for field in static_fields(self.dimension)
            if field.name in PARTICLE_ARRAYS
        }
        arrays["ghosts"] = arrays["ghosts"].astype(np.bool_)
        return Particles(
            **arrays,
            tags={tag: data[tag_name(tag)][()].astype(np.bool_) for tag in _lines(run, "tags")},
            bodies={
                name: slice(int(start), int(stop))
                for name, (start, stop) in zip(
                    _lines(run, "bodies"), run["body_ranges"][()], strict=True
                )
            },
            faces=dict(
                _face(run[f"faces/{number}"]) for number in range(len(run.get("faces", ())))
            ),
        )

    def _readable(self, count: int, datasets: list[Any]) -> int:
        """Number of the `count` steps that can be read; a file may have lost its end."""
        n = self.particles.count
        for dataset in datasets:
            _check_rows(dataset, count * n)
        if self.is_closed_by_writer:
            return count
        while count and n:
            try:
                for dataset in datasets:
                    dataset[count * n - 1]
                break
            except HDF5_ERRORS:
                count -= 1
        return count

    def _series(self, dataset: Any, count: int) -> TimeSeries:
        components = tuple(int(size) for size in dataset.attrs["components"])
        n = self.particles.count

        def read(first: int, stop: int) -> Array:
            rows: Array = self._with_retries(lambda: dataset[first * n : stop * n])
            return unpadded(rows, components).reshape(stop - first, n, *components)

        return TimeSeries((count, n, *components), _word(dataset, "units"), read)

    def _with_retries(self, read: Callable[[], T]) -> T:
        """Call `read`, again if it fails while the run goes on."""
        for _ in range(_ATTEMPTS):
            try:
                return read()
            except HDF5_ERRORS as error:
                failure = reason(error)
            if self._is_complete and self._file is None:
                raise RecordError(f"the record {self.path} is closed; open it again")
            if not _may_change(self.path):
                break
            time.sleep(_PAUSE)
        raise RecordError(
            f"the record {self.path} cannot be read: {failure}; "
            "if it is damaged, run its scene again"
        ) from None


def _head(path: Path) -> bytes:
    """The first bytes of an HDF5 file."""
    if path.is_dir():
        raise RecordError(f"{path} is a folder, not a record; name the file in it")
    if not path.exists():
        raise RecordError(f"there is no record {path}; check the path, or run the scene first")
    if not path.is_file():  # a pipe would keep `open` waiting
        raise RecordError(f"{path} is not a regular file, so no record of solidsph")
    with path.open("rb") as file:
        head = file.read(64)
    if not head.startswith(SIGNATURE):
        raise NotARecordError(f"{path} is not an HDF5 file, so no record of solidsph")
    return head


def _run(file: Any, path: Path) -> Any:
    """The group that VTK ignores."""
    link = file.get("solidsph", getlink=True)
    run = file["solidsph"] if isinstance(link, h5py.HardLink) else None
    if run is None or "format" not in run.attrs:
        raise NotARecordError(f"{path} is an HDF5 file, but not a record of solidsph")
    return run


def check_is_record(path: Path) -> None:
    """Raise NotARecordError unless a file is a record, damaged or not; little of it is read."""
    _head(path)
    with suppress(*HDF5_ERRORS), HDF5Source(path) as opened, h5py.File(opened, "r") as file:
        _run(file, path)


def _may_change(path: Path) -> bool:
    try:
        return is_unclosed(_head(path))
    except (OSError, RecordError):
        return False


def _check_rows(dataset: Any, rows: int) -> None:
    if dataset.shape[0] < rows:
        # Damage, or the run went on since the last read: then a new attempt helps.
        raise OSError(f"{dataset.name} has {dataset.shape[0]} rows instead of {rows}")


def _first(dataset: Any, rows: int) -> Any:
    _check_rows(dataset, rows)
    return dataset[:rows]


def _lines(group: Any, name: str) -> tuple[str, ...]:
    return tuple(line.decode() for line in group[name][()])


def _word(item: Any, name: str) -> str:
    return bytes(item.attrs[name]).decode()


def _face(group: Any) -> tuple[str, Face]:
    indices = group["particles"][()].astype(np.intp)
    return _word(group, "name"), Face(indices, group["area_vectors"][()], group["areas"][()])
