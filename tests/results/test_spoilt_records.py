"""Whatever a record holds: an answer, one message, no traceback, no end without end."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from solidsph import BuildError, Record, RecordError, Scene, Simulation, resume
from solidsph.results import recorder
from solidsph.results.contents import Reference
from solidsph.results.repair import repaired
from tests.helpers.fuzzing import within
from tests.helpers.scenes import SCENE_TOML
from tests.helpers.waiting import HANG


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A finished record, and one of a run that was killed."""
    folder = tmp_path_factory.mktemp("records")
    path = folder / "run.h5"
    simulation = Simulation.builder(Scene.from_toml(SCENE_TOML)).build()
    simulation.run(record=path)
    found = {"finished": path.read_bytes()}
    taken: list[bytes] = []

    real = recorder.RecordWriter.close

    def close(self: recorder.RecordWriter, outcome: str = "finished") -> None:
        # As a kill would leave the file.
        taken.append(path.read_bytes())
        real(self, outcome)

    patch = pytest.MonkeyPatch()
    patch.setattr(recorder.RecordWriter, "close", close)
    simulation.run(record=path)
    patch.undo()
    found["killed"] = taken[-1]
    return found


def read_all(path: Path) -> int:
    """Everything that can be read; the number of steps."""
    with Record(path) as record:
        for name in record.field_names:
            record.field(name)[:]
        record.positions[:]
        return record.count


def read_or_refused(path: Path) -> int | None:
    """The number of steps, or None where one message of one line says what is wrong."""
    try:
        return read_all(path)
    except RecordError as cause:
        message = str(cause)
    assert "\n" not in message
    return None


def outcome_of(path: Path, data: bytes) -> str:
    """What becomes of a spoilt record: "read", "refused"; anything else is raised."""
    path.write_bytes(data)
    with within(HANG):
        return "refused" if read_or_refused(path) is None else "read"


def spoilt(data: bytes, chance: random.Random) -> bytes:
    changed = bytearray(data)
    kind = chance.random()
    if kind < 0.5:
        for _ in range(chance.choice((1, 1, 3, 30))):
            changed[chance.randrange(len(data))] ^= chance.randrange(1, 256)
    elif kind < 0.6:
        del changed[chance.randrange(len(data)) :]
    elif kind < 0.8:
        start = chance.randrange(len(data))
        size = chance.choice((1, 8, 512, 4096))
        changed[start : start + size] = bytes(min(size, len(data) - start))
    else:
        start, other = chance.randrange(len(data)), chance.randrange(len(data))
        changed[start : start + 64] = data[other : other + 64]
    return bytes(changed)


def corrupt(path: Path, records: dict[str, bytes], count: int, seed: int) -> None:
    chance = random.Random(seed)
    told = [
        outcome_of(path, spoilt(records[kind], chance))
        for _ in range(count // 2)
        for kind in ("finished", "killed")
    ]
    print({one: told.count(one) for one in set(told)})
    assert {"read", "refused"} == set(told)


def test_corrupted_records(tmp_path: Path, records: dict[str, bytes]) -> None:
    corrupt(tmp_path / "run.h5", records, 60, seed=0)


@pytest.mark.validation
def test_a_thousand_corrupted_records(tmp_path: Path, records: dict[str, bytes]) -> None:
    corrupt(tmp_path / "run.h5", records, 1000, seed=1)


@pytest.mark.parametrize("kind", ["finished", "killed"])
def test_truncated_at_bytes_of_the_end(
    tmp_path: Path, records: dict[str, bytes], kind: str
) -> None:
    """A killed record gives the steps before the cut; a closed one says that it is damaged."""
    data, path = records[kind], tmp_path / "run.h5"
    path.write_bytes(data)
    whole = read_all(path)
    counts = []
    for size in range(len(data) - 1, len(data) - 4097, -41 if kind == "killed" else -137):
        path.write_bytes(data[:size])
        count = read_or_refused(path)
        counts.append(-1 if count is None else count)
    assert max(counts) <= whole
    if kind == "killed":
        assert min(counts) >= whole - 2
    else:
        assert set(counts) == {-1}


@pytest.mark.validation
def test_truncated_at_each_single_byte(tmp_path: Path, records: dict[str, bytes]) -> None:
    for data in records.values():
        for size in range(len(data) - 1, len(data) - 4097, -1):
            outcome_of(tmp_path / "run.h5", data[:size])


def test_what_is_left_of_a_truncated_record_is_copied(
    tmp_path: Path, records: dict[str, bytes]
) -> None:
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    path.write_bytes(records["killed"][:-2000])
    left = read_all(path)
    assert repaired(path, copy) == left >= 1
    assert read_all(copy) == left


def test_a_truncated_record_goes_on(tmp_path: Path, records: dict[str, bytes]) -> None:
    """What lost its end is made up for; there is no checkpoint, and none is needed."""
    path, whole = tmp_path / "run.h5", tmp_path / "whole.h5"
    whole.write_bytes(records["finished"])
    path.write_bytes(records["killed"][:-2000])
    resume(path)
    with Record(path) as record, Record(whole) as other:
        assert record.outcome == "finished"
        assert np.array_equal(record.positions[:], other.positions[:])


def test_no_scene_in_a_record_runs_code(
    tmp_path: Path, records: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not even where somebody has made its digest right again."""
    path = tmp_path / "run.h5"
    path.write_bytes(records["killed"])
    with Record(path) as record:
        right = record.reference.digest()
    old = b"1e3*min(t/0.005, 1)"
    new = b"__import__('os')   "
    assert len(old) == len(new)
    assert records["killed"].count(old) == 1
    path.write_bytes(records["killed"].replace(old, new))
    with pytest.raises(RecordError, match="not those that were written"):
        resume(path)
    monkeypatch.setattr(Reference, "digest", lambda self: right)
    with pytest.raises(BuildError, match="is not allowed"):
        resume(path)
