"""Reads the record of a run: finished, still running, or killed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.results.contents import Output, Reference
from solidsph.results.error_bars import read_error_bars
from solidsph.results.hdf5_reading import check_rows, first_rows, lines, read_particles, word
from solidsph.results.hdf5_source import HDF5Source, is_unclosed
from solidsph.results.layout import (
    FORMAT,
    HDF5_ERRORS,
    READABLE,
    Field,
    PluginUsed,
    reason,
    unpadded,
)
from solidsph.results.layout_checks import Tree, check_first, check_rest, check_values
from solidsph.results.record_kind import group_of_run, head_of, may_change
from solidsph.results.recorded import DISPLACEMENT
from solidsph.results.time_series import TimeSeries

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from solidsph.probes.values import Values

T = TypeVar("T")

ALL = slice(None)

# While the run goes on, a block of the file may be read half written, or the file be replaced.
_ATTEMPTS = 4
_PAUSE = 0.02  # s


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
        versions: of the software that produced the run, by its name; digests of the files that
            bodies were read from, by "file PATH".
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
        self.is_closed_by_writer = not is_unclosed(head_of(self.path))
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
        run = group_of_run(self._file, self.path)
        written = int(run.attrs["format"])
        if written not in READABLE:
            remedy = "update solidsph" if written > FORMAT else "run its scene again"
            raise RecordError(
                f"the record {self.path} has format {written}, this solidsph reads "
                f"{READABLE[0]} to {FORMAT}; {remedy}"
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
        self.versions = dict(line.rsplit(" ", 1) for line in lines(run, "versions"))
        self.notes = tuple(line.decode() for line in run.attrs.get("notes", ()))
        self.outcome = bytes(run["outcome"][()]).decode(errors="ignore")
        self.folder = word(run, "folder")
        self.field_names = lines(run, "fields")
        check_rest(tree, announced, self.field_names, lines(run, "tags"))
        self.particles = read_particles(run, grid["PointData"], self.dimension)
        sets = {name: grid["PointData"][name] for name in self.field_names}
        self.units = {name: word(dataset, "units") for name, dataset in sets.items()}

        count = self._readable(announced, [grid["Points"], *sets.values()])
        self.times: Array = first_rows(grid["Steps/Values"], count)
        self.steps: NDArray[np.int64] = first_rows(run["step"], count)
        self.positions = self._series(grid["Points"], count)
        self._fields = {name: self._series(dataset, count) for name, dataset in sets.items()}
        table = run.get("history")
        names = table.dtype.names if table is not None else ()
        self.history: Mapping[str, Array] = MappingProxyType(
            {name: np.ascontiguousarray(first_rows(table, count)[name]) for name in names}
        )
        units = table.attrs["units"] if table is not None else ()
        self.history_units = {name: unit.decode() for name, unit in zip(names, units, strict=True)}
        self.error_bars = MappingProxyType(read_error_bars(self._file))
        check_values(self.particles, self.times, self.steps)
        if self.reference.digest().hex() != word(run, "digest"):
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

        `displacement` is one of every record: the positions less those of the reference [m].

        Raises:
            RecordError: the record has no such field.
        """
        if name == DISPLACEMENT and name not in self._fields:
            return self._displacement()
        if name not in self._fields:
            near = get_close_matches(name, self.field_names, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            known = ", ".join(dict.fromkeys([*self.field_names, DISPLACEMENT]))
            raise RecordError(f"no field {name!r} in {self.path}; {hint}fields: {known}")
        return self._fields[name]

    def _displacement(self) -> TimeSeries:
        positions, X = self.positions, self.particles.positions
        return TimeSeries(
            positions.shape, "m", lambda first, stop: np.asarray(positions[first:stop] - X)
        )

    def to_pandas(self) -> pandas.DataFrame:
        """The history as a table, one row an output, over the time [s].

        Raises:
            RecordError: pandas is not installed.
        """
        from solidsph.results.tables import history_table  # loaded only when asked for

        return history_table(self)

    def to_xarray(
        self, fields: Sequence[str] | None = None, outputs: slice = ALL
    ) -> xarray.Dataset:
        """Fields over outputs and particles, and the history over outputs, with units.

        Args:
            fields: their names, also `displacement`; by default all that the record holds.
            outputs: which outputs, all by default. What is asked for is read at once.

        Raises:
            RecordError: xarray is not installed, or there is no such field.
        """
        from solidsph.results.tables import dataset  # loaded only when asked for

        return dataset(self, fields, outputs)

    def plot(self, what: str = "motion", field: str = "cauchy_stress") -> Figure:
        """A picture: "motion", "energy" or "probes"; see `solidsph.results.pictures.figure`.

        Raises:
            RecordError: there is no such picture or field, or no probe.
        """
        from solidsph.results.pictures import figure  # imports the plotting library

        return figure(self, what, field)

    def view(
        self,
        field: str = "cauchy_stress",
        *,
        time: float | None = None,
        factor: float = 1.0,
        picture: Path | str | None = None,
    ) -> None:
        """Show the run in 3D, or draw a picture of it; see `solidsph.results.view.view`.

        Raises:
            RecordError: PyVista is not installed, or the record has no output or no such field.
        """
        from solidsph.results.view import view  # imports the graphics library

        view(self, field=field, time=time, factor=factor, picture=picture)

    def __repr__(self) -> str:
        outputs = f"{self.count} outputs of {self.particles.count} particles"
        return f"Record({str(self.path)!r}: {self.outcome}, {outputs})"

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        from solidsph.results.tables import overview

        return overview(self)

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

    def _readable(self, count: int, datasets: list[Any]) -> int:
        """Number of the `count` steps that can be read; a file may have lost its end."""
        n = self.particles.count
        for dataset in datasets:
            check_rows(dataset, count * n)
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

        return TimeSeries((count, n, *components), word(dataset, "units"), read)

    def _with_retries(self, read: Callable[[], T]) -> T:
        """Call `read`, again if it fails while the run goes on."""
        for _ in range(_ATTEMPTS):
            try:
                return read()
            except HDF5_ERRORS as error:
                failure = reason(error)
            if self._is_complete and self._file is None:
                raise RecordError(f"the record {self.path} is closed; open it again")
            if not may_change(self.path):
                break
            time.sleep(_PAUSE)
        raise RecordError(
            f"the record {self.path} cannot be read: {failure}; "
            "if it is damaged, run its scene again"
        ) from None


def plotted(path: Path, what: str, field: str) -> Figure:
    """A picture of the record in a file; see `Record.plot`."""
    with Record(path) as record:
        return record.plot(what, field)
