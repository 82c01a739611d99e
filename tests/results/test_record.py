"""A record gives back what was put in: to its reader, to VTK, and after every kind of accident."""

from __future__ import annotations

import contextlib
import gzip
import os
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import attrs
import h5py
import numpy as np
import pytest
import pyvista
from hypothesis import given
from hypothesis import strategies as st

from solidsph.errors import DivergedError, RecordError
from solidsph.model.particles import Face, Particles
from solidsph.results.contents import Output, Reference
from solidsph.results.hdf5_source import _lookup3
from solidsph.results.layout import FORMAT, MOST_TAGS, Field, PluginUsed, tag_name
from solidsph.results.record import Record
from solidsph.results.record_writer import RecordWriter
from solidsph.results.repair import repaired
from solidsph.results.time_series import TimeSeries
from tests.helpers.examples import examples
from tests.helpers.waiting import wait_for

PLUGINS = (
    PluginUsed("solidsph.kernels", "cubic-spline", "solidsph", "0.1.0", "a.b:CubicSpline"),
    PluginUsed("solidsph.materials", "gummi-bär", "someone-else", "2.0", "c:Bär"),
)
SCENE = 'title = "wave – in a bar"\n[kernel]\nname = "cubic-spline"\n'
COLUMNS = {"kinetic": "J", "residual": "-", "reaction left/x": "N"}


def some_particles(count: int, dimension: int, seed: int = 0) -> Particles:
    """Every array different and nothing zero, so that a mix-up shows."""
    random = np.random.default_rng(seed)
    half = count // 2
    chosen = np.flatnonzero(random.random(count) < 0.5)
    return Particles(
        positions=random.normal(size=(count, dimension)),
        volumes=random.random(count),
        spacings=random.random(count),
        area_vectors=random.normal(size=(count, dimension)),
        ghosts=random.random(count) < 0.3,
        images=random.normal(size=(count, dimension)),
        tags={name: random.random(count) < 0.5 for name in ("left", "a/b", "100 %", "a%2Fb")},
        bodies={"bar": slice(0, half), "the wall": slice(half, count)},
        faces={
            "top/left": Face(
                chosen, random.normal(size=(len(chosen), dimension)), random.random(len(chosen))
            ),
            "none": Face(chosen[:0], np.zeros((0, dimension))),
        },
        cells=random.random(count),
    )


def some_fields(dimension: int) -> list[Field]:
    d = dimension
    return [
        Field("velocity", (d,), "m/s"),
        Field("stress", (d, d), "Pa"),
        Field("volume_ratio", (), "-"),
    ]


def some_step(number: int, particles: Particles, seed: int = 0) -> Output:
    """The same for the same arguments, in every process."""
    random = np.random.default_rng([seed, number])
    n, d = particles.count, particles.dimension
    return Output(
        time=1e-3 * number,
        step=10 * number,
        positions=random.normal(size=(n, d)),
        fields={field.name: random.normal(size=(n, *field.components)) for field in some_fields(d)},
        history={name: float(random.normal()) for name in COLUMNS},
    )


def reference(particles: Particles, **others: object) -> Reference:
    shown = {"scene": SCENE, "plugins": PLUGINS, "columns": COLUMNS, **others}
    return Reference(particles=particles, **shown)


def opened(path: Path, particles: Particles, **others: object) -> RecordWriter:
    fields = some_fields(particles.dimension)
    return RecordWriter(path, reference(particles, fields=fields), **others)


def append(writer: RecordWriter, step: Output) -> None:
    writer.append(step)


def written(path: Path, count: int, dimension: int, steps: int, seed: int = 0) -> list[Output]:
    """Writes a closed record; returns what went into it."""
    particles = some_particles(count, dimension, seed)
    content = [some_step(number, particles, seed) for number in range(steps)]
    with opened(path, particles) as writer:
        for step in content:
            append(writer, step)
    return content


def assert_same_particles(a: Particles, b: Particles) -> None:
    for name in ("positions", "volumes", "cells", "spacings", "area_vectors", "ghosts", "images"):
        x, y = getattr(a, name), getattr(b, name)
        assert x.dtype == y.dtype
        np.testing.assert_array_equal(x, y)
    assert list(a.tags) == list(b.tags)
    for tag in a.tags:
        assert b.tags[tag].dtype == np.bool_
        np.testing.assert_array_equal(a.tags[tag], b.tags[tag])
    assert dict(a.bodies) == dict(b.bodies)
    assert list(a.faces) == list(b.faces)
    for face in a.faces:
        np.testing.assert_array_equal(a.faces[face].particles, b.faces[face].particles)
        np.testing.assert_array_equal(a.faces[face].area_vectors, b.faces[face].area_vectors)
        np.testing.assert_array_equal(a.faces[face].areas, b.faces[face].areas)
    assert {field.name for field in attrs.fields(Particles)} == {
        "positions", "volumes", "spacings", "area_vectors", "ghosts", "images", "tags", "bodies",
        "faces", "cells",
    }, "Particles has grown: a record must hold the new array too"  # fmt: skip


def assert_holds(record: Record, content: list[Output]) -> None:
    """Every number of every step."""
    assert record.count == len(record.positions) == len(content)
    np.testing.assert_array_equal(record.times, [step.time for step in content])
    np.testing.assert_array_equal(record.steps, [step.step for step in content])
    for i, step in enumerate(content):
        np.testing.assert_array_equal(record.positions[i], step.positions)
        for name in record.field_names:
            np.testing.assert_array_equal(record.field(name)[i], step.fields[name])
    assert list(record.history) == list(COLUMNS)
    for name, values in record.history.items():
        np.testing.assert_array_equal(values, [step.history[name] for step in content])


# What went in comes out


@examples(25)
@given(
    count=st.integers(0, 9),
    dimension=st.integers(1, 3),
    steps=st.integers(0, 4),
    seed=st.integers(0, 2**32 - 1),
)
def test_round_trip(count: int, dimension: int, steps: int, seed: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.vtkhdf"
        content = written(path, count, dimension, steps, seed)
        with Record(path) as record:
            assert_holds(record, content)
            assert_same_particles(some_particles(count, dimension, seed), record.particles)
            assert record.dimension == dimension


def test_the_run_is_described(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    written(path, 4, 2, 3)
    with Record(path) as record:
        assert record.scene == SCENE
        assert record.plugins == PLUGINS
        assert record.field_names == ("velocity", "stress", "volume_ratio")
        assert record.units == {"velocity": "m/s", "stress": "Pa", "volume_ratio": "-"}
        assert record.history_units == COLUMNS
        assert record.outcome == "finished"
        assert record.is_closed_by_writer
        assert record.versions["numpy"] == np.__version__
        assert record.versions["python"] == ".".join(map(str, sys.version_info[:3]))


def test_units_stand_at_the_arrays(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    written(path, 4, 2, 1)
    with h5py.File(path) as file:
        grid = file["VTKHDF"]
        assert grid["Points"].attrs["units"] == b"m"
        assert grid["PointData/stress"].attrs["units"] == b"Pa"
        assert grid["PointData/volume"].attrs["units"] == b"m^2"
        assert all("units" in array.attrs for array in grid["PointData"].values())


def test_a_record_without_plugins_fields_columns_tags(tmp_path: Path) -> None:
    particles = attrs.evolve(some_particles(3, 1), tags={}, bodies={}, faces={})
    path = tmp_path / "run.vtkhdf"
    with RecordWriter(path, reference(particles, plugins=[], fields=[], columns={})) as writer:
        writer.append(Output(0.0, 0, particles.positions, {}, {}))
    with Record(path) as record:
        assert (record.plugins, record.field_names, dict(record.history)) == ((), (), {})
        np.testing.assert_array_equal(record.positions[0], particles.positions)
        assert_same_particles(particles, record.particles)


def test_same_run_same_bytes(tmp_path: Path) -> None:
    written(tmp_path / "a", 5, 2, 3)
    begun = int(time.time())
    wait_for(lambda: int(time.time()) > begun)  # HDF5 counts seconds
    written(tmp_path / "b", 5, 2, 3)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_small_run_makes_a_small_file(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    particles = some_particles(60, 1)
    fields = [Field("velocity", (1,), "m/s")]
    step = some_step(0, particles)
    with RecordWriter(path, reference(particles, fields=fields)) as writer:
        for i in range(200):
            fields_of_step = {"velocity": step.positions}
            writer.append(Output(i, i, step.positions, fields_of_step, step.history))
    content = 200 * 60 * (3 + 3) * 8
    assert path.stat().st_size < content + 100_000


# The lazy view


def counting(reads: list[tuple[int, int]]) -> TimeSeries:
    def read(first: int, stop: int) -> np.ndarray:
        reads.append((first, stop))
        return np.arange(first, stop, dtype=float)[:, None] * np.ones(2)

    return TimeSeries((5, 2), "m", read)


def test_only_what_is_asked_for_is_read() -> None:
    reads: list[tuple[int, int]] = []
    series = counting(reads)
    np.testing.assert_array_equal(series[-2], [3, 3])
    np.testing.assert_array_equal(series[1:3], [[1, 1], [2, 2]])
    np.testing.assert_array_equal(series[::-2], [[4, 4], [2, 2], [0, 0]])
    assert series[3:1].shape == (0, 2)
    assert reads == [(3, 4), (1, 3), (4, 5), (2, 3), (0, 1), (3, 3)]


def test_a_series_is_a_sequence() -> None:
    series = counting([])
    assert [int(row[0]) for row in series] == [0, 1, 2, 3, 4]
    assert np.asarray(series).shape == (5, 2)
    assert series[np.int64(4)][0] == 4
    for index in (5, -6):
        with pytest.raises(IndexError, match="record of 5 steps"):
            series[index]


def test_an_unknown_field_names_the_nearest(tmp_path: Path) -> None:
    written(tmp_path / "run", 3, 2, 1)
    with (
        Record(tmp_path / "run") as record,
        pytest.raises(RecordError, match=r"'velocty'.*mean 'velocity'.*velocity, stress"),
    ):
        record.field("velocty")


def test_a_closed_record_says_so(tmp_path: Path) -> None:
    written(tmp_path / "run", 3, 2, 1)
    with Record(tmp_path / "run") as record:
        pass
    assert len(record.times) == 1
    with pytest.raises(RecordError, match="closed"):
        record.positions[0]


# VTK's own reader agrees


def vtk_steps(
    path: Path,
) -> list[tuple[float | None, np.ndarray, np.ndarray, dict[str, np.ndarray]]]:
    """Times, points, cells as (n, 2) of point counts and ids, arrays: all as VTK reads them."""
    io = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import VTK_VERTEX
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    reader = io.vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    steps = []
    for t in times or [None]:  # a single step has no time to VTK
        if t is None:
            reader.Update()
        else:
            reader.UpdateTimeStep(t)
        grid = reader.GetOutput()
        data = grid.GetPointData()
        assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {VTK_VERTEX}
        cells = [
            (grid.GetCell(i).GetNumberOfPoints(), grid.GetCell(i).GetPointId(0))
            for i in range(grid.GetNumberOfCells())
        ]
        arrays = {
            data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)).copy()
            for i in range(data.GetNumberOfArrays())
        }
        points = vtk_to_numpy(grid.GetPoints().GetData()).copy()
        steps.append((t, points, np.array(cells), arrays))
    return steps


def in_three(values: np.ndarray) -> np.ndarray:
    """(n, d) or (n, d, d) as VTK has it, written without the code under test."""
    spare = 3 - values.shape[-1]
    pads = [(0, 0)] + [(0, spare)] * (values.ndim - 1)
    return np.pad(values, pads).reshape(len(values), -1)


@pytest.mark.parametrize(("dimension", "count"), [(1, 5), (2, 5), (3, 5), (2, 1), (3, 1030)])
def test_vtk_reads_every_number(tmp_path: Path, dimension: int, count: int) -> None:
    path = tmp_path / "run.vtkhdf"
    content = written(path, 7, dimension, count)
    particles = some_particles(7, dimension)
    steps = vtk_steps(path)
    if count > 1:
        assert [t for t, *_ in steps] == [step.time for step in content]
    for (_, points, cells, arrays), step in zip(steps, content, strict=True):
        np.testing.assert_array_equal(points, in_three(step.positions))
        np.testing.assert_array_equal(cells, [(1, i) for i in range(7)])
        expected = {
            "velocity": in_three(step.fields["velocity"]),
            "stress": in_three(step.fields["stress"]),
            "volume_ratio": step.fields["volume_ratio"],
            "reference_position": in_three(particles.positions),
            "volume": particles.volumes,
            "cell": particles.cells,
            "spacing": particles.spacings,
            "area_vector": in_three(particles.area_vectors),
            "ghost": particles.ghosts,
            "image": in_three(particles.images),
            "body": np.repeat([0, 1], [3, 4]),
            "tags": sum(2**k * mask for k, mask in enumerate(particles.tags.values())),
        }
        assert set(arrays) == set(expected)
        for name, values in expected.items():
            np.testing.assert_array_equal(arrays[name], values, err_msg=name)


NAMES = {"tag left": 1, "tag a%2Fb": 2, "tag 100 %25": 4, "tag a%252Fb": 8} | {
    "body bar": 0,
    "body the wall": 1,
}


@pytest.mark.parametrize("name", ["run.vtkhdf", "run.h5"])
def test_pyvista_reads_it_with_the_names_of_tags_and_bodies(tmp_path: Path, name: str) -> None:
    written(tmp_path / name, 7, 2, 3)
    particles = some_particles(7, 2)
    grid = pyvista.read(tmp_path / name, force_ext=".vtkhdf" if name.endswith("h5") else None)
    np.testing.assert_array_equal(grid.points, in_three(some_step(0, particles).positions))
    numbers = {key: int(grid.field_data[key][0]) for key in grid.field_data if key != "Time"}
    assert numbers == NAMES
    assert grid["tags"].dtype.kind == "i"
    left = (grid["tags"] & grid.field_data["tag left"]) != 0
    np.testing.assert_array_equal(left, particles.tags["left"])
    wall = grid["body"] == grid.field_data["body the wall"]
    np.testing.assert_array_equal(wall, np.arange(7) >= 3)


def test_tags_are_bits_of_one_integer(tmp_path: Path) -> None:
    """As many as it has, all of them on one particle and none on another."""
    some = some_particles(3, 2)
    tags = {f"t{k}": np.arange(3) == 1 for k in range(MOST_TAGS)}
    tags |= {"bar": np.arange(3) < 1}  # the body, which takes no bit
    assert_tags_kept(tmp_path / "run", attrs.evolve(some, tags=tags))


def assert_tags_kept(path: Path, particles: Particles) -> None:
    with opened(path, particles) as writer:
        append(writer, some_step(0, particles))
    with Record(path) as record:
        assert list(record.particles.tags) == list(particles.tags)
        for name, mask in particles.tags.items():
            np.testing.assert_array_equal(record.particles.tags[name], mask)


def test_tags_beyond_the_bits_of_an_integer(tmp_path: Path) -> None:
    """As a polygon with many edges has."""
    some = some_particles(3, 2)
    tags = {f"t/{k}": np.arange(3) == k % 3 for k in range(MOST_TAGS + 8)}
    tags |= {"bar": np.arange(3) < 1}
    assert_tags_kept(tmp_path / "run", attrs.evolve(some, tags=tags))
    last = f"t/{MOST_TAGS + 7}"
    with h5py.File(tmp_path / "run", "a") as file:
        del file[f"VTKHDF/PointData/{tag_name(last)}"]
    with pytest.raises(RecordError, match="t/69"):
        Record(tmp_path / "run").particles  # noqa: B018


def test_a_record_of_the_format_before_is_read(tmp_path: Path) -> None:
    """Written by `written(path, 7, 2, 2)` while each tag was a field of its own."""
    path = tmp_path / "run.h5"
    path.write_bytes(
        gzip.decompress((Path(__file__).parent / "earlier/format-2.h5.gz").read_bytes())
    )
    particles = some_particles(7, 2)
    steps = [some_step(number, particles) for number in range(2)]
    with Record(path) as record:
        assert_holds(record, steps)
        assert_same_particles(record.particles, particles)
    assert repaired(path, tmp_path / "copy") == 2  # in the present format
    with Record(tmp_path / "copy") as record:
        assert_same_particles(record.particles, particles)
    with h5py.File(tmp_path / "copy") as file:
        assert file["solidsph"].attrs["format"] == FORMAT


# Accidents while writing

CHILD = """
import sys
sys.path.insert(0, {folder!r})
from pathlib import Path
from tests.results.test_record import append, opened, some_particles, some_step
particles = some_particles({count}, 2)
writer = opened(Path({path!r}), particles)
print("ready", flush=True)
for number in range(10**9):
    if number % {burst} == 3:
        print("waits", flush=True)
        sys.stdin.readline()
    append(writer, some_step(number, particles))
"""


@contextlib.contextmanager
def running(path: Path, count: int, burst: int):
    """A process that writes a record as fast as it can, until the block ends.

    After three steps, and after every `burst` of them, it waits for `go_on`: what it has written
    is bounded, and known, however slow this process is.
    """
    code = CHILD.format(
        folder=str(Path(__file__).parents[2]), count=count, path=str(path), burst=burst
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], **pipes) as child:
        try:
            assert child.stdout is not None
            assert child.stdout.readline() == b"ready\n"
            yield child
        finally:
            child.send_signal(signal.SIGKILL)


def wait_for_burst(child: subprocess.Popen[bytes]) -> None:
    assert child.stdout is not None
    assert child.stdout.readline() == b"waits\n"


def go_on(child: subprocess.Popen[bytes]) -> None:
    assert child.stdin is not None
    child.stdin.write(b"\n")
    child.stdin.flush()


def assert_is_start_of_the_run(record: Record, count: int) -> None:
    particles = some_particles(count, 2)
    assert_same_particles(particles, record.particles)
    assert_holds(record, [some_step(i, particles) for i in range(record.count)])


@pytest.mark.parametrize(
    ("count", "delay"),
    [
        (60, 0.0),
        (60, 0.03),
        (9000, 0.15),
        *(pytest.param(*one, marks=pytest.mark.validation) for one in [(60, 0.11), (9000, 0.02)]),
    ],
)
def test_a_killed_run_leaves_a_readable_record(tmp_path: Path, count: int, delay: float) -> None:
    path = tmp_path / "run.vtkhdf"
    with running(path, count, burst=150) as child:
        if delay:
            wait_for_burst(child)
            go_on(child)
        time.sleep(delay)  # which decides nothing but where the process is
    with Record(path) as record:
        assert not record.is_closed_by_writer
        assert record.outcome == "running"
        assert (3 if delay else 0) <= record.count <= 153
        assert_is_start_of_the_run(record, count)
        steps = record.count

    copy = tmp_path / "copy.vtkhdf"
    assert repaired(path, copy) == steps
    with Record(copy) as record:
        assert record.is_closed_by_writer
        assert record.outcome == "interrupted"
        assert (record.scene, record.plugins) == (SCENE, PLUGINS)
        assert_is_start_of_the_run(record, count)
    if 0 < steps < 100 and count == 60:
        assert len(vtk_steps(copy)) == steps


def test_reading_while_the_run_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    lengths = []
    with running(path, 300, burst=20) as child:
        wait_for_burst(child)
        early = Record(path)
        for _ in range(8):
            go_on(child)
            with Record(path) as record:
                last = record.count - 1
                lengths.append(record.count)
                expected = some_step(last, record.particles)
                np.testing.assert_array_equal(record.positions[last], expected.positions)
                np.testing.assert_array_equal(record.field("stress")[-1], expected.fields["stress"])
                assert record.times[-1] == expected.time
            wait_for_burst(child)
        # A record opened earlier still gives the steps that it had then.
        assert early.count == 3
        assert_is_start_of_the_run(early, 300)
        early.close()
    assert lengths == sorted(lengths)
    assert lengths[-1] > lengths[0] >= 3


def test_others_may_read_along_by_the_rules_of_hdf5(tmp_path: Path) -> None:
    path = tmp_path / "run"
    with running(path, 60, burst=100) as child:
        wait_for_burst(child)
        with h5py.File(path, swmr=True, locking=False) as file:
            points = file["VTKHDF/Points"]
            before = points.shape[0]
            assert before == 3 * 60
            go_on(child)
            wait_for_burst(child)
            points.refresh()
            assert points.shape[0] == 103 * 60
            first = some_step(0, some_particles(60, 2))
            np.testing.assert_array_equal(points[:60, :2], first.positions)


def test_a_killed_and_truncated_record_gives_what_is_left(tmp_path: Path) -> None:
    path, cut = tmp_path / "run", tmp_path / "cut"
    particles = some_particles(200, 2)
    writer = opened(path, particles)
    for number in range(50):
        append(writer, some_step(number, particles))
    data = path.read_bytes()  # as a kill would leave it
    writer.close()
    lengths = []
    for share in (1.0, 0.9, 0.5, 0.2):
        cut.write_bytes(data[: int(share * len(data))])
        with Record(cut) as record:
            lengths.append(record.count)
            assert_is_start_of_the_run(record, 200)
    assert lengths[0] == 50 > lengths[1] > lengths[2] > lengths[3] > 0
    for size in (5, 40, 3000):
        cut.write_bytes(data[:size])
        with pytest.raises(RecordError):
            Record(cut)


def test_a_full_disk_is_noticed_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    particles = some_particles(5, 2)
    with opened(tmp_path / "run", particles) as writer:
        append(writer, some_step(0, particles))
        with monkeypatch.context() as patch:
            patch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(free=1000))
            with pytest.raises(RecordError, match="disk is full; the 1 steps before it remain"):
                append(writer, some_step(1, particles))
        append(writer, some_step(1, particles))
    with Record(tmp_path / "run") as record:
        assert_holds(record, [some_step(0, particles), some_step(1, particles)])


FAILING_DEVICE = """
import resource, signal, sys
sys.path.insert(0, {folder!r})
from pathlib import Path
from solidsph.errors import RecordError
from solidsph.results import record_writer
from tests.results.test_record import append, opened, some_particles, some_step
path = Path({path!r})
particles = some_particles(500, 3)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
record_writer.check_space = lambda path, size: None  # as if the device failed all of a sudden
with opened(path, particles) as writer:
    for number in range(9):
        if number == 2:  # no file may grow beyond this, which HDF5 learns when it writes
            limit = path.stat().st_size + {room}
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        try:
            append(writer, some_step(number, particles))
        except RecordError as error:
            print(error)
            resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
"""


@pytest.mark.parametrize("room", [0, 5_000, 50_000])
def test_a_failing_device_keeps_the_steps_before(tmp_path: Path, room: int) -> None:
    path = tmp_path / "run"
    code = FAILING_DEVICE.format(folder=str(Path(__file__).parents[2]), path=str(path), room=room)
    child = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert (child.returncode, child.stderr) == (0, "")
    first, *others = child.stdout.splitlines()
    assert first.startswith("cannot write step 20 to the record")
    assert "File too large; the 2 steps before it remain" in first
    assert len(others) == 6
    assert all("is closed" in line for line in others)
    particles = some_particles(500, 3)
    with Record(path) as record:
        assert_holds(record, [some_step(0, particles), some_step(1, particles)])


@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (ValueError("no such thing"), "stopped: ValueError: no such thing"),
        (KeyboardInterrupt(), "stopped: KeyboardInterrupt"),
        (
            DivergedError(step=7, time=0.1, particle=3, volume_ratio=-0.5, cause="J < 0"),
            "diverged: the run diverged at step 7, t = 0.1 s: J < 0 at particle 3",
        ),
        (RuntimeError("ä" * 2000), "stopped: RuntimeError: ää"),
    ],
)
def test_an_error_becomes_the_outcome(tmp_path: Path, error: BaseException, outcome: str) -> None:
    path = tmp_path / "run"
    particles = some_particles(3, 2)

    def run() -> None:
        with opened(path, particles) as writer:
            append(writer, some_step(0, particles))
            raise error

    with pytest.raises(type(error)):
        run()
    with Record(path) as record:
        assert record.outcome.startswith(outcome)
        assert_holds(record, [some_step(0, particles)])


def test_an_interrupt_amid_a_step_leaves_it_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    particles = some_particles(3, 2)

    def interrupt(file: h5py.File) -> None:
        monkeypatch.undo()
        raise KeyboardInterrupt

    def run() -> None:
        with opened(tmp_path / "run", particles) as writer:
            append(writer, some_step(0, particles))
            monkeypatch.setattr(h5py.File, "flush", interrupt)
            append(writer, some_step(1, particles))

    with pytest.raises(KeyboardInterrupt):
        run()
    with Record(tmp_path / "run") as record:
        assert record.is_closed_by_writer
        assert record.outcome == "stopped: KeyboardInterrupt"
        assert_holds(record, [some_step(0, particles)])


def test_the_first_outcome_stays(tmp_path: Path) -> None:
    with opened(tmp_path / "run", some_particles(3, 2)) as writer:
        writer.close("diverged: too fast")
    with Record(tmp_path / "run") as record:
        assert record.outcome == "diverged: too fast"
    with pytest.raises(RecordError, match="closed"):
        append(writer, some_step(0, some_particles(3, 2)))


# Mistakes of the caller


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.zeros((4, 3))}, r"'positions' must have shape \(4, 2\), got \(4, 3\)"),
        ({"fields": {}}, "missing: velocity, stress, volume_ratio"),
        ({"history": dict.fromkeys([*COLUMNS, "heat"], 0.0)}, "not declared: heat"),
        ({"time": 0.0}, "times must increase"),
        ({"time": float("nan")}, "times must increase"),
    ],
)
def test_a_step_that_does_not_fit_is_refused_whole(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    particles = some_particles(4, 2)
    with opened(tmp_path / "run", particles) as writer:
        append(writer, some_step(0, particles))
        with pytest.raises(RecordError, match=message):
            append(writer, attrs.evolve(some_step(1, particles), **change))
        append(writer, some_step(1, particles))
    with Record(tmp_path / "run") as record:
        assert_holds(record, [some_step(0, particles), some_step(1, particles)])


@pytest.mark.parametrize(
    "field",
    [
        Field("volume", (), "m"),
        Field("tags", (), "-"),
        Field("a/b", (), "-"),
        Field("", (), "-"),
        Field("spin", (3,), "1/s"),
    ],
)
def test_a_field_that_cannot_be_held(tmp_path: Path, field: Field) -> None:
    with pytest.raises(RecordError, match="field"):
        RecordWriter(tmp_path / "run", reference(some_particles(3, 2), fields=[field], columns={}))
    assert list(tmp_path.iterdir()) == []


# Where a record may go


def test_folders_are_made_and_files_replaced(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "run"
    written(path, 3, 2, 5)
    content = written(path, 4, 1, 2)
    with Record(path) as record:
        assert_holds(record, content)
    assert list(path.parent.iterdir()) == [path]


def test_an_existing_file_can_be_kept(tmp_path: Path) -> None:
    content = written(tmp_path / "run", 3, 2, 2)
    with pytest.raises(RecordError, match="exists already"):
        opened(tmp_path / "run", some_particles(3, 2), overwrite=False)
    with Record(tmp_path / "run") as record:
        assert_holds(record, content)


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    content = written(tmp_path / "link", 3, 2, 1)
    assert (tmp_path / "link").is_symlink()
    with Record(tmp_path / "real") as record:
        assert_holds(record, content)


@contextlib.contextmanager
def without_privileges():
    """Root may write everywhere, so root becomes nobody for a while."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def test_places_where_no_record_can_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    os.mkfifo(tmp_path / "pipe")
    cases = {
        tmp_path: "is a folder.*result.vtkhdf",
        tmp_path / "pipe": "not a regular file",
        tmp_path / "file" / "run": "cannot create.*choose",
        tmp_path / ("long" * 100): "cannot create.*choose",
    }
    for path, message in cases.items():
        with pytest.raises(RecordError, match=message):
            opened(path, some_particles(3, 2))
    assert (tmp_path / "file").read_text() == "not a folder"
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_places_without_permission() -> None:
    # Not below pytest's own folder, which nobody else may enter.
    folder = Path(tempfile.mkdtemp())
    try:
        folder.chmod(0o755)
        locked, file = folder / "locked", folder / "file"
        locked.mkdir()
        locked.chmod(0o555)
        file.write_text("keep me")
        file.chmod(0o444)
        folder.chmod(0o777)
        with without_privileges():
            with pytest.raises(RecordError, match=r"cannot create.*choose"):
                opened(locked / "run", some_particles(3, 2))
            with pytest.raises(RecordError, match=r"cannot create.*choose"):
                opened(locked / "deeper" / "run", some_particles(3, 2))
            with pytest.raises(RecordError, match=r"may not be replaced.*writable"):
                opened(file, some_particles(3, 2))
            folder.joinpath("secret").write_text("")
            folder.joinpath("secret").chmod(0o000)
            with pytest.raises(RecordError, match=r"cannot be read.*Permission denied"):
                Record(folder / "secret")
        assert file.read_text() == "keep me"
        assert list(locked.iterdir()) == []
    finally:
        locked.chmod(0o777)
        shutil.rmtree(folder)


# Files that are no record


def assert_refused(path: Path, message: str) -> None:
    with pytest.raises(RecordError, match=message) as caught:
        Record(path)
    assert "\n" not in str(caught.value)
    assert caught.value.__suppress_context__ or caught.value.__context__ is None


def test_what_is_no_record_is_refused(tmp_path: Path) -> None:
    assert_refused(tmp_path / "missing", "no record .*missing")
    assert_refused(tmp_path, "is a folder")
    file = tmp_path / "file"
    for content in (b"", b"velocity, 3\n", b"\x89HDF\r\n\x1a", os.urandom(5000)):
        file.write_bytes(content)
        assert_refused(file, "not an HDF5 file")
    file.write_bytes(b"\x89HDF\r\n\x1a\n" + b"\x03\x08\x08\x05" + bytes(200))
    assert_refused(file, "cannot be read")
    with h5py.File(file, "w") as other:
        other["VTKHDF/Points"] = np.zeros((3, 3))
    assert_refused(file, "not a record of solidsph")


def test_a_newer_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run"
    written(path, 3, 2, 1)
    with h5py.File(path, "r+") as file:
        file["solidsph"].attrs["format"] = FORMAT + 1
    assert_refused(path, f"has format {FORMAT + 1}, this solidsph reads 2 to {FORMAT}; update")


def test_an_older_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run"
    written(path, 3, 2, 1)
    with h5py.File(path, "r+") as file:
        file["solidsph"].attrs["format"] = 1
    assert_refused(path, f"has format 1, this solidsph reads 2 to {FORMAT}; run its scene again")


def test_a_truncated_record_is_refused(tmp_path: Path) -> None:
    path, cut = tmp_path / "run", tmp_path / "cut"
    written(path, 50, 2, 20)
    data = path.read_bytes()
    for size in (9, 47, 100, 5000, len(data) // 2, len(data) - 1):
        cut.write_bytes(data[:size])
        assert_refused(cut, "cannot be read")


@pytest.mark.parametrize("part", ["solidsph/outcome", "VTKHDF/PointData/velocity", "VTKHDF"])
def test_a_record_that_lacks_something_is_refused(tmp_path: Path, part: str) -> None:
    path = tmp_path / "run"
    written(path, 3, 2, 1)
    with h5py.File(path, "r+") as file:
        del file[part]
    assert_refused(path, "cannot be read")


def test_random_damage_is_noticed_or_harmless(tmp_path: Path) -> None:
    """Damaged bytes give a RecordError, or other numbers; never any other error."""
    path, broken = tmp_path / "run", tmp_path / "broken"
    written(path, 5, 2, 3)
    data = path.read_bytes()
    random = np.random.default_rng(0)
    refused = 0
    for _ in range(40):
        damaged = bytearray(data)
        for place in random.integers(0, len(data), size=20):
            damaged[place] ^= int(random.integers(1, 256))
        broken.write_bytes(damaged)
        try:
            with Record(broken) as record:
                for name in record.field_names:
                    record.field(name)[:]
                record.positions[:]
        except RecordError:
            refused += 1
    assert refused > 5


def test_a_record_cannot_be_its_own_copy(tmp_path: Path) -> None:
    content = written(tmp_path / "run", 3, 2, 2)
    with pytest.raises(RecordError, match="its own"):
        repaired(tmp_path / "run", tmp_path / "run")
    assert repaired(tmp_path / "run", tmp_path / "copy") == 2
    with Record(tmp_path / "copy") as record:
        assert_holds(record, content)
        assert record.outcome == "finished"


def test_checksum_of_the_superblock() -> None:
    # The value that the author of the hash gives as an example in its source.
    assert _lookup3(b"Four score and seven years ago") == 0x17770551
