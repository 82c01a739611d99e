"""A record belongs to one run at a time, and what an earlier one left is not lost unsaid."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import h5py
import pytest

from solidsph import BusyError, Record, RecordError, Scene, Simulation, resume
from solidsph.cli import cli
from solidsph.results.checkpoint import checkpoint_path
from solidsph.results.earlier_run import EarlierRun, earlier_run_at
from solidsph.results.sole_writer import check_no_writer, sole_writer
from solidsph.run.hooks import implementation
from tests.helpers.resuming import Stop, assert_same_record
from tests.helpers.scenes import SCENE_TOML, box


def moving() -> Simulation:
    return box(1, 12).initial(velocity={"x": "3*sin(2*X)"}).outputs(4).build()


class At:
    """Does something at an output."""

    def __init__(self, output: int, act) -> None:
        self._left, self._act = output, act

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self._left -= 1
        if self._left == 0:
            self._act()


class Counting:
    """Hears outputs."""

    def __init__(self) -> None:
        self.count = 0

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self.count += 1


def refusal(act) -> str:
    with pytest.raises(RecordError) as caught:
        act()
    assert "\n" not in str(caught.value)
    return str(caught.value)


# One writer


def test_the_second_writer_is_told_who_holds_the_record(tmp_path: Path) -> None:
    """Another run of this process, a resume, and one through a link."""
    path = tmp_path / "run.h5"
    (tmp_path / "link.h5").symlink_to(path)
    told: list[str] = []

    def meanwhile() -> None:
        other = moving()
        told.append(refusal(lambda: other.run(record=path)))
        told.append(refusal(lambda: other.run(record=tmp_path / "link.h5")))
        told.append(refusal(lambda: resume(path)))

    moving().run(record=path, observers=[At(3, meanwhile)])
    for one in told:
        assert f"is being written by another run (process {os.getpid()} on " in one
        assert "since 20" in one
    assert len(told) == 3
    moving().run(record=tmp_path / "whole.h5")
    assert_same_record(tmp_path / "whole.h5", path)
    assert not list(tmp_path.glob(".*"))  # the lock is gone
    moving().run(record=path)


def test_another_process_is_kept_out_and_its_death_frees_the_record(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    code = (
        "import sys; from pathlib import Path\n"
        "from solidsph.results.sole_writer import sole_writer\n"
        f"with sole_writer(Path({str(path)!r})): print('held', flush=True); sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as child:
        assert child.stdout.readline() == b"held\n"
        assert f"process {child.pid} on" in refusal(lambda: moving().run(record=path))
        assert f"process {child.pid} on" in refusal(lambda: check_no_writer(path))
        child.kill()
        child.wait()
    check_no_writer(path)  # although what it left behind is there
    assert list(tmp_path.glob(".*"))
    moving().run(record=path)
    assert not list(tmp_path.glob(".*"))


def test_a_fork_does_not_hold_what_its_parent_held(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with sole_writer(path):
        ours, theirs = os.pipe()
        child = os.fork()
        if not child:  # lives on after its parent has let go
            os.close(theirs)
            os.read(ours, 1)
            os._exit(0)
        os.close(ours)
    check_no_writer(path)
    with sole_writer(path):
        pass
    os.close(theirs)
    os.waitpid(child, 0)


def test_a_run_reports_what_it_computed(tmp_path: Path) -> None:
    """And not what it reads again from a file that another has replaced."""
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    result = moving().run(record=path)
    with Record(path) as record:
        final = {name: values[-1] for name, values in record.history.items()}
    assert result.final == final
    box(1, 6).initial(velocity={"x": 1.0}).outputs(2).build().run(record=other)
    other.replace(path)
    assert result.final == final
    assert moving().run().final == final  # without a record


# One run of a simulation


def test_one_simulation_in_two_threads_is_refused() -> None:
    simulation = moving()
    heard, told = Counting(), []

    def second() -> None:
        with pytest.raises(BusyError, match="another thread"):
            simulation.run(observers=[heard])
        told.append(True)

    def meanwhile() -> None:
        thread = threading.Thread(target=second)
        thread.start()
        thread.join()

    first = Counting()
    simulation.run(observers=[first, At(2, meanwhile)])
    assert (first.count, heard.count, told) == (5, 0, [True])
    simulation.run(observers=[heard])
    assert heard.count == 5


def test_two_simulations_in_threads_hear_their_own(tmp_path: Path) -> None:
    heard = [Counting(), Counting()]
    whole = tmp_path / "whole.h5"
    moving().run(record=whole)
    simulations = [moving() for _ in heard]

    def run(k: int) -> None:
        simulations[k].run(record=tmp_path / f"{k}.h5", observers=[heard[k]])

    threads = [threading.Thread(target=run, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [one.count for one in heard] == [5, 5]
    for k in range(2):
        assert_same_record(whole, tmp_path / f"{k}.h5")


def test_after_an_error_it_can_be_run_again(tmp_path: Path) -> None:
    simulation = moving()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(record=tmp_path / "run.h5", observers=[Stop(2)])
    resume(tmp_path / "run.h5", simulation=simulation)


# What is replaced


def interrupted(path: Path, output: int = 3) -> bytes:
    with pytest.raises(KeyboardInterrupt):
        moving().run(record=path, observers=[Stop(output)])
    return path.read_bytes()


def test_what_was_recorded_stays_until_there_is_more(tmp_path: Path) -> None:
    """A run that fails at its first output leaves the record and its checkpoint as they were."""
    path = tmp_path / "run.h5"
    before = interrupted(path)
    checkpoint = checkpoint_path(path).read_bytes()

    class Failing:
        @implementation
        def solidsph_setup(self, simulation) -> None:
            raise OSError("no such device")

    with pytest.raises(OSError, match="no such device"):
        moving().run(record=path, observers=[Failing()])
    assert path.read_bytes() == before
    assert checkpoint_path(path).read_bytes() == checkpoint
    assert not list(tmp_path.glob("*.partial"))
    resume(path)


def test_a_full_disk_at_the_first_output_keeps_the_older_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.h5"
    before = interrupted(path)
    calls: list[int] = []
    for asked in (1, 2):  # room for the file, and room for its first output

        def full(where: Path, size: int, asked: int = asked) -> None:
            calls.append(size)
            if len(calls) >= asked:
                raise OSError("the disk is full")

        calls.clear()
        monkeypatch.setattr("solidsph.results.record_writer.check_space", full)
        assert "the disk is full" in refusal(lambda: moving().run(record=path))
        assert path.read_bytes() == before
        assert not list(tmp_path.glob("*.partial"))


@pytest.mark.parametrize("kind", ["pipe", "text", "other HDF5", "folder"])
def test_what_is_no_record_is_never_replaced(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "run.h5"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "text":
        path.write_text("my notes\n")
    elif kind == "other HDF5":
        with h5py.File(path, "w") as file:
            file["mine"] = 1.0
    else:
        path.mkdir()
    before = path.read_bytes() if path.is_file() else None
    mode = path.stat().st_mode
    assert "not" in refusal(lambda: moving().run(record=path))
    assert path.stat().st_mode == mode
    assert before is None or path.read_bytes() == before


@pytest.mark.parametrize("kind", ["a link", "a link to nothing", "a pipe", "a folder"])
def test_what_is_no_lock_is_neither_followed_nor_waited_for(tmp_path: Path, kind: str) -> None:
    """A link in the lock's place once led to a file of the user's, which was emptied."""
    path, lock, notes = tmp_path / "run.h5", tmp_path / ".run.h5.lock", tmp_path / "notes"
    if kind == "a link":
        notes.write_text("mine")
    if kind == "a pipe":
        os.mkfifo(lock)
    elif kind == "a folder":
        lock.mkdir()
    else:
        lock.symlink_to(notes)
    for act in (lambda: moving().run(record=path), lambda: check_no_writer(path)):
        assert "is not a regular file" in refusal(act)
    assert (notes.read_text() if kind == "a link" else notes.exists()) == (
        "mine" if kind == "a link" else False
    )
    assert lock.is_symlink() or not lock.is_file()


def test_a_link_goes_on_from_the_checkpoint_of_its_record(tmp_path: Path) -> None:
    real, link = tmp_path / "real" / "run.h5", tmp_path / "link.h5"
    with pytest.raises(KeyboardInterrupt):
        moving().run(record=real, observers=[Stop(4)])
    link.symlink_to(real)
    heard = Counting()
    resume(link, observers=[heard])
    assert heard.count == 2  # the fourth, before whose checkpoint it was stopped, and the fifth
    assert sorted(one.name for one in real.parent.iterdir()) == ["run.checkpoint", "run.h5"]
    assert not checkpoint_path(link).is_relative_to(link)
    moving().run(record=tmp_path / "whole.h5")
    assert_same_record(tmp_path / "whole.h5", real)


def test_records_of_two_suffixes_have_a_checkpoint_each(tmp_path: Path) -> None:
    names = ("run.h5", "run.vtkhdf", "other.h5", "run.h5.vtkhdf")
    assert len({checkpoint_path(tmp_path / name) for name in names}) == len(names)


def test_an_unsound_run_did_not_end_early() -> None:
    earlier = EarlierRun("unsound: the energies do not add up", 5, 0.25)
    assert earlier.description == "an unsound run up to t = 0.25 s"
    assert not earlier.can_resume


def test_a_link_stays_and_a_file_without_a_byte_is_nothing(tmp_path: Path) -> None:
    real, link = tmp_path / "real.h5", tmp_path / "run.h5"
    real.touch()
    link.symlink_to(real)
    moving().run(record=link)
    assert link.is_symlink()
    assert earlier_run_at(real).outcome == "finished"


@pytest.mark.parametrize("what", ["record", "folder", "replaced"])
def test_who_loses_the_record_amid_the_run_is_told(tmp_path: Path, what: str) -> None:
    folder = tmp_path / "out"
    path = folder / "run.h5"

    def lose() -> None:
        for one in folder.iterdir() if what == "folder" else [path]:
            one.unlink()
        if what == "folder":
            folder.rmdir()
        if what == "replaced":
            path.write_text("mine")

    told = refusal(lambda: moving().run(record=path, observers=[At(3, lose)]))
    word = "replaced by another file" if what == "replaced" else "removed"
    assert f"was {word} while the run wrote it, and its 3 steps are lost" in told
    # Nothing of the program's own takes the place of what was removed.
    left = sorted(one.name for one in tmp_path.rglob("*"))
    assert left == {"record": ["out"], "folder": [], "replaced": ["out", "run.h5"]}[what]
    assert what != "replaced" or path.read_text() == "mine"


# The commands


def command(*words: str, code: int = 0) -> None:
    assert (cli.main([*words], standalone_mode=False) or 0) == code


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE_TOML)
    return tmp_path


def test_run_asks_before_it_replaces_what_can_be_gone_on_with(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "results" / "scene" / "record.h5"
    with pytest.raises(KeyboardInterrupt):
        Simulation.builder(Scene.from_toml(SCENE_TOML)).build().run(
            record=path, observers=[Stop(4)]
        )
    before = path.read_bytes()
    told = refusal(lambda: command("run", "scene.toml"))
    assert "holds an interrupted run up to t = 0.00" in told
    assert f"solidsph resume {path.relative_to(folder)}" in told
    assert "--overwrite" in told
    assert path.read_bytes() == before
    command("run", "scene.toml", "--json", "--overwrite")
    out, err = capsys.readouterr()
    assert json.loads(out)["record"] == "results/scene/record.h5"
    assert "holds an interrupted run up to t = 0.00" in err
    assert earlier_run_at(path).outcome == "finished"
    # What is finished may be replaced, which is said.
    command("run", "scene.toml", "--json")
    assert "holds a finished run up to t = 0.01 s; it is replaced" in capsys.readouterr().err


def test_scenes_of_one_name_in_two_folders_are_told_of(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        (folder / name).mkdir()
        (folder / name / "scene.toml").write_text(SCENE_TOML)
    command("run", "a/scene.toml")
    assert "replaced" not in capsys.readouterr().err
    command("run", "b/scene.toml")
    assert "it is replaced" in capsys.readouterr().err


def test_a_record_may_have_the_suffix_of_vtk(folder: Path) -> None:
    command("run", "scene.toml", "--quiet", "--output", "out/plate.vtkhdf")
    assert earlier_run_at(folder / "out" / "plate.vtkhdf").outcome == "finished"
    command("resume", "out")
    assert not stat.S_ISDIR((folder / "out" / "plate.vtkhdf").stat().st_mode)


def test_reading_by_h5py_and_by_us_at_once(tmp_path: Path) -> None:
    """In one process HDF5 lets no file be open twice in two ways."""
    path = tmp_path / "run.h5"
    moving().run(record=path)
    with h5py.File(path) as file, Record(path) as record:
        assert len(file["VTKHDF/Steps/Values"]) == record.count
    with Record(path) as record, h5py.File(path) as file:
        assert len(file["VTKHDF/Steps/Values"]) == record.count

    counts: list[int] = []

    def look() -> None:
        with Record(path) as record:
            counts.append(record.count)

    moving().run(record=path, observers=[At(3, look)])
    assert counts == [3]
