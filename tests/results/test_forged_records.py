"""A record whose parts are not what they seem is refused in one line, and never goes on."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from solidsph import Record, RecordError, Scene, Simulation, resume
from tests.helpers.fuzzing import within
from tests.helpers.resuming import Stop
from tests.helpers.scenes import SCENE_TOML

SECONDS = 60.0  # nothing here takes one; a read without end would never stop


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An interrupted run without its checkpoint, so that resuming has to rely on the record."""
    path = tmp_path_factory.mktemp("original") / "run.h5"
    simulation = Simulation.builder(Scene.from_toml(SCENE_TOML)).build()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(record=path, observers=[Stop(3)])
    path.with_suffix(".checkpoint").unlink()
    return path


# What VTK needs to show particles as points, and nobody else reads.
FOR_VTK = (
    *("Connectivity", "VTKHDF/Offsets", "VTKHDF/Types", "NumberOf", "PartOffsets", "CellOffsets"),
    *("PointOffsets", "PointDataOffsets", "FieldData"),
)


def places(path: Path) -> list[tuple[str, str]]:
    """Every dataset, group and attribute: its path and, of an attribute, its name."""
    found: list[tuple[str, str]] = []

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if any(word in name for word in FOR_VTK):
            return
        found.append((name, ""))
        # What units and components reference data have is known without asking.
        evolves = isinstance(item, h5py.Dataset) and item.maxshape[:1] == (None,)
        found.extend(
            (name, key)
            for key in item.attrs
            if key not in ("Version", "Type")
            and (evolves or key not in ("units", "components"))
            and (name, key) != ("VTKHDF/Steps/Values", "units")
        )

    with h5py.File(path) as file:
        file.visititems(visit)
    return found


Replacement = Callable[[h5py.Group, str], None]


def value(made: object) -> Replacement:
    def put(holder: h5py.Group, name: str) -> None:
        holder[name] = made

    return put


def claimed(holder: h5py.Group, name: str) -> None:
    """Exabytes, of which none are stored."""
    holder.create_dataset(name, shape=(2**50,), dtype=np.float64, chunks=(2**10,))


def outside(holder: h5py.Group, name: str) -> None:
    """Data in a pipe, which HDF5 would wait for."""
    pipe = str(Path(holder.file.filename).with_name("pipe"))
    holder.create_dataset(name, shape=(8,), dtype=np.float64, external=[(pipe, 0, 64)])


def of_elsewhere(holder: h5py.Group, name: str) -> None:
    layout = h5py.VirtualLayout(shape=(4,), dtype=np.float64)
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=(4,))
    holder.create_virtual_dataset(name, layout)


DATASETS: dict[str, Replacement] = {
    "missing": lambda holder, name: None,
    "a group": lambda holder, name: holder.create_group(name) and None,
    "empty": value(h5py.Empty("f8")),
    "texts": value(np.array([b"a", b"b"])),
    "long texts": value(np.array(["a", "b"], dtype=h5py.string_dtype())),
    "one number": value(1.0),
    "a NaN": value(np.full(3, np.nan)),
    "of high rank": value(np.zeros((2, 2, 2, 2))),
    "without rows": value(np.zeros((0, 3))),
    "complex": value(np.zeros(4, dtype=complex)),
    "a table": value(np.zeros(3, dtype=[("a", "f8"), ("b", "i4")])),
    "references": lambda holder, name: (
        holder.create_dataset(name, data=[holder.ref], dtype=h5py.ref_dtype) and None
    ),
    "a soft link": value(h5py.SoftLink("/VTKHDF/Points")),
    "a link to itself": lambda holder, name: holder.__setitem__(
        name, h5py.SoftLink(f"{holder.name}/{name}")
    ),
    "a link out of the file": value(h5py.ExternalLink("pipe", "/x")),
    "a type": value(np.dtype("f8")),
    "claimed": claimed,
    "outside": outside,
    "of elsewhere": of_elsewhere,
}

ATTRIBUTES: dict[str, object] = {
    "text": b"x",
    "long text": "x",
    "real": np.float64(np.nan),
    "negative": np.int64(-7),
    "huge": np.int64(2**62),
    "row": np.arange(5),
    "square": np.zeros((2, 2)),
    "empty": h5py.Empty("f8"),
    "missing": None,
}


def spoilt(original: Path, folder: Path, every: int) -> Iterator[tuple[str, Path]]:
    """Every thing in the record replaced by everything, or one in so many of these."""
    os.mkfifo(folder / "pipe")
    path = folder / "run.h5"
    ways = [
        (place, attribute, name)
        for place, attribute in places(original)
        for name in (ATTRIBUTES if attribute else DATASETS)
    ]
    for place, attribute, name in ways[::every]:
        shutil.copyfile(original, path)
        with h5py.File(path, "r+", locking=False) as file:
            if attribute:
                del file[place].attrs[attribute]
                if ATTRIBUTES[name] is not None:
                    file[place].attrs[attribute] = ATTRIBUTES[name]
            else:
                above, _, own = place.rpartition("/")
                holder = file[above] if above else file
                del holder[own]
                DATASETS[name](holder, own)
        yield f"{place}@{attribute} {name}".replace("@ ", " "), path


def read_all(path: Path) -> None:
    with Record(path) as record:
        for name in record.field_names:
            record.field(name)[:]
        record.positions[:]


def refused(act: Callable[[Path], None], path: Path) -> bool:
    """Whether it was refused in one line; any other error is raised."""
    try:
        with within(SECONDS):
            act(path)
    except RecordError as cause:
        told = str(cause)
    else:
        return False
    assert "\n" not in told
    assert len(told) < 600
    return True


def campaign(original: Path, folder: Path, every: int) -> None:
    accepted = [
        what for what, path in spoilt(original, folder, every) if not refused(read_all, path)
    ]
    assert accepted == []


def test_some_of_all_that_can_be_wrong(original: Path, tmp_path: Path) -> None:
    campaign(original, tmp_path, every=29)


@pytest.mark.validation
def test_all_that_can_be_wrong(original: Path, tmp_path: Path) -> None:
    campaign(original, tmp_path, every=1)


def test_other_values_in_the_right_shape_are_noticed(original: Path, tmp_path: Path) -> None:
    """Reference data when the record is opened, an output when a run goes on from it."""
    path = tmp_path / "run.h5"
    with h5py.File(original) as file:
        names = file["solidsph/fields"][()].astype(str)
    evolving = ["VTKHDF/Points", *(f"VTKHDF/PointData/{name}" for name in names)]
    history = ["VTKHDF/Steps/Values", "solidsph/step", "solidsph/digests", "solidsph/history"]
    reference = [f"VTKHDF/PointData/{name}" for name in ("volume", "cell", "tags")]
    reference += [f"solidsph/{name}" for name in ("scene", "plugins", "versions")]
    for place in (*reference, *evolving, *history):
        shutil.copyfile(original, path)
        flip_a_bit(path, place)
        assert refused(read_all, path) == (place in reference), place
        assert refused(gone_on_with, path), place


def gone_on_with(path: Path) -> None:
    resume(path)


def flip_a_bit(path: Path, place: str) -> None:
    """The lowest one of a byte within what is stored of a dataset."""
    with h5py.File(path) as file:
        dataset = file[place]
        chunked = dataset.chunks is not None
        start = dataset.id.get_chunk_info(0).byte_offset if chunked else dataset.id.get_offset()
    with path.open("r+b") as raw:
        raw.seek(start + 2)
        byte = raw.read(1)[0]
        raw.seek(start + 2)
        raw.write(bytes([byte ^ 1]))


def test_a_record_behind_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        assert refused(read_all, path)
        assert refused(gone_on_with, path)
