"""Sweeps: killed at any point, nothing finished is lost, nothing finished is run twice."""

from __future__ import annotations

import fcntl
import io
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import inf, isnan, nan
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import attrs
import numpy as np
import pytest
from rich.console import Console
from rich.progress import Progress

from solidsph.commands.console import SweepObserver, time_left
from solidsph.errors import RecordError, SceneError
from solidsph.studies import cluster as cluster_module
from solidsph.studies import scratch_folder as scratch_module
from solidsph.studies import task as task_module
from solidsph.studies.cluster import Cluster
from solidsph.studies.journal import VERSION, Journal
from solidsph.studies.point import Point
from solidsph.studies.processes import Processes
from solidsph.studies.remaining_time import RemainingTime
from solidsph.studies.runner import Inline, Lost, Outcomes, Runner
from solidsph.studies.scratch_folder import ScratchFolder
from solidsph.studies.sweep import SweepStatus, sweep
from solidsph.studies.task import Task, plain
from solidsph.studies.task_lines import decode_outcome, decode_task, encode_outcome, encode_task
from solidsph_cases.csm3 import Csm3
from tests.helpers.sweeping import Odd, odd, several, swinging
from tests.helpers.waiting import HANG, wait_for
from tests.house.test_architecture import modules_after

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _findable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other processes find this folder's modules where this one does."""
    monkeypatch.syspath_prepend(str(ROOT))


def bare(points: Sequence[Point]) -> Sequence[Point]:
    """What hangs on no machine."""
    return [attrs.evolve(point, seconds=(), peak_memory=0) for point in points]


def lines(path: Path) -> Sequence[bytes]:
    return path.read_bytes().splitlines(keepends=True)


def log(folder: Path) -> Sequence[Sequence[str]]:
    """Deed, error and process of each run."""
    path = folder / "log"
    return [line.rsplit(" ", 2) for line in path.read_text().splitlines()] if path.exists() else []


@attrs.frozen
class Backwards(Runner):
    """The last task first."""

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        yield from Inline().run(list(reversed(tasks)))


@attrs.frozen
class Interrupted(Runner):
    """Somebody presses Ctrl-C after so many tasks."""

    after: int

    def run(self, tasks: Sequence[Task]) -> Outcomes:
        yield from Inline().run(tasks[: self.after])
        raise KeyboardInterrupt


# --- order, repeats, going on


def test_points_come_in_the_order_of_the_tasks(tmp_path: Path) -> None:
    first, second = several(tmp_path, 0.3, 0.1)
    tasks = [first, second, attrs.evolve(first, repeat=1), second]
    points = sweep(tasks, Backwards(), Journal(tmp_path / "journal"))
    assert [point.error for point in points] == [0.3, 0.1]
    assert [len(point.seconds) for point in points] == [2, 1]
    assert len(log(tmp_path)) == 3  # the same task asked for twice is one


@pytest.mark.parametrize("after", range(4))
def test_an_interrupted_sweep_goes_on_where_it_was(tmp_path: Path, after: int) -> None:
    tasks, journal = several(tmp_path, 0.3, inf, 0.1), Journal(tmp_path / "new" / "journal")
    with pytest.raises(KeyboardInterrupt):
        sweep(tasks, Interrupted(after), journal)
    assert len(log(tmp_path)) == after
    seen: list[SweepStatus] = []
    points = sweep(tasks, Inline(), journal, seen.append)
    assert [point.error for point in points] == [0.3, inf, 0.1]
    assert [one for _, one, _ in log(tmp_path)] == ["0.3", "inf", "0.1"]
    assert [(one.total, one.kept, one.done) for one in seen] == [
        (3, after, done) for done in range(4 - after)
    ]
    assert seen[-1].remaining == 0
    before = (journal.path.read_bytes(), log(tmp_path))
    assert bare(sweep(tasks, Inline(), journal)) == bare(points)
    assert (journal.path.read_bytes(), log(tmp_path)) == before


def test_tasks_may_be_added_later(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal")
    sweep(several(tmp_path, 0.3), Inline(), journal)
    points = sweep(several(tmp_path, 0.1, 0.3, 0.2), Inline(), journal)
    assert [point.error for point in points] == [0.1, 0.3, 0.2]
    assert [one for _, one, _ in log(tmp_path)] == ["0.3", "0.1", "0.2"]


def test_a_result_is_kept_and_a_loss_is_tried_again(tmp_path: Path) -> None:
    tasks, journal = odd(tmp_path, "refuse", "break"), Journal(tmp_path / "journal")
    for _ in range(2):
        refused, broken = sweep(tasks, Inline(), journal)
        assert (refused.error, refused.outcome) == (inf, "refused")
        assert (broken.error, broken.outcome) == (inf, "RuntimeError: broken")
    assert [deed for deed, _, _ in log(tmp_path)] == ["refuse", "break", "break"]
    assert len(lines(journal.path)) == 1


def test_of_repeats_the_lost_ones_are_missing(tmp_path: Path) -> None:
    class Once(Runner):
        def run(self, tasks: Sequence[Task]) -> Outcomes:
            yield tasks[0], Lost("gone")
            yield from Inline().run(tasks[1:])

    (task,) = several(tmp_path, 0.3)
    tasks = [task, attrs.evolve(task, repeat=1), attrs.evolve(task, repeat=2)]
    (point,) = sweep(tasks, Once(), Journal(tmp_path / "journal"))
    assert (point.error, point.outcome, len(point.seconds)) == (0.3, "finished", 2)


# --- the journal


def test_a_line_torn_at_any_byte_is_run_again_and_nothing_else(tmp_path: Path) -> None:
    tasks, journal = several(tmp_path, 0.3, inf), Journal(tmp_path / "journal")
    sweep(tasks, Inline(), journal)
    first, last = lines(journal.path)
    assert len(last) > 200
    for cut in range(len(last) + 1):
        journal.path.write_bytes(first + last[:cut])
        whole = cut >= len(last) - 1  # only the end of the line is missing
        held = journal.points(tasks)
        assert [task.key in held for task in tasks] == [True, whole]
        points = sweep(tasks, Inline(), journal)
        assert [point.error for point in points] == [0.3, inf]
        assert journal.path.read_bytes().startswith(first + last[:cut])
        assert list(journal.points(tasks)) == [task.key for task in tasks]
    # Twice in the first sweep; then the first task never again, the second where it was torn.
    assert [one for _, one, _ in log(tmp_path)].count("0.3") == 1
    assert [one for _, one, _ in log(tmp_path)].count("inf") == 1 + len(last) - 1


def test_what_is_no_line_of_ours_is_passed_over_and_left(tmp_path: Path) -> None:
    tasks, journal = several(tmp_path, 0.3, 0.1), Journal(tmp_path / "journal")
    sweep(tasks[:1], Inline(), journal)
    (own,) = lines(journal.path)
    entry = json.loads(own)
    other = json.dumps({**entry, "key": tasks[1].key, "journal": VERSION + 1}).encode()
    partial = json.dumps({**entry, "key": tasks[1].key, "point": {"error": 1.0}}).encode()
    foreign = b"\n".join([b"# a note", b"\xff\x00", b"[1]", b"null", b"", other, partial, b""])
    journal.path.write_bytes(foreign + own)
    points = sweep(tasks, Inline(), journal)
    assert [point.error for point in points] == [0.3, 0.1]
    assert journal.path.read_bytes().startswith(foreign + own)
    assert [one for _, one, _ in log(tmp_path)] == ["0.3", "0.1"]


def test_infinities_and_no_numbers_survive_in_strict_json(tmp_path: Path) -> None:
    (task,) = several(tmp_path, 0.3)
    wide = Task(task.case, {"cover": 2.2, "material": {"type": "x"}, "pair": (1, 2)})
    point = Point(
        wide.settings,
        nan,
        outcome='why\nnot "é"',
        quantity="q",
        value=-inf,
        spacing=inf,
        particles=3,
        steps=4,
        pair_evaluations=2**60,
        bytes_touched=2**61,
        seconds=(inf, 0.1),
        peak_memory=5,
    )
    journal = Journal(tmp_path / "journal")
    with journal.writer() as append:
        append(wide, point)

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    (line,) = lines(journal.path)
    json.loads(line, parse_constant=refuse)
    for read in (journal.points([wide])[wide.key], decode_outcome(encode_outcome(point), wide)):
        assert isinstance(read, Point)
        assert isnan(read.error)
        assert attrs.evolve(read, error=0.0) == attrs.evolve(point, error=0.0)


def test_two_sweeps_on_one_journal_are_refused(tmp_path: Path) -> None:
    tasks, journal = several(tmp_path, 0.3), Journal(tmp_path / "journal")
    with journal.writer(), pytest.raises(RecordError, match="another sweep is writing"):
        sweep(tasks, Inline(), journal)
    assert log(tmp_path) == []
    sweep(tasks, Inline(), journal)


# --- keys


def test_keys_are_the_same_in_every_process() -> None:
    code = (
        "from tests.helpers.sweeping import swinging, several\nfrom pathlib import Path\n"
        "print(*[task.key for task in [*swinging(), *several(Path('/x'), 0.1, float('inf'))]])"
    )
    wanted = [task.key for task in [*swinging(), *several(Path("/x"), 0.1, inf)]]
    assert len(set(wanted)) == len(wanted)
    for seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
        assert done.stdout.split() == wanted


def test_keys_tell_apart_what_differs(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Csm3(across=3)
    key = Task(case, {"cover": 2.2, "outputs": 3}).key
    assert Task(Csm3(across=3), {"outputs": 3, "cover": 2.2}).key == key
    others = [
        Task(Csm3(across=4), {"cover": 2.2, "outputs": 3}),
        Task(case, {"cover": np.nextafter(2.2, 3.0), "outputs": 3}),
        Task(case, {"cover": 2.2}),
        Task(case, {"cover": 2.2, "outputs": 3}, repeat=1),
        Task(case, {"cover": -2.2, "outputs": 3}),  # refused, but a task
    ]
    assert len({key, *(task.key for task in others)}) == 6

    def later(name: str) -> str:
        return "99.0"

    monkeypatch.setattr(task_module, "version", later)
    assert Task(case, {"cover": 2.2, "outputs": 3}).key != key


def test_keys_follow_the_versions_of_the_parts_used_and_of_no_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plain_task, theirs = Task(Csm3()), Task(Csm3(), {"kernel": "wendland-c2"})
    keys = plain_task.key, theirs.key
    installed = task_module._installed(None)
    assert any(entry.distribution == "solidsph-wendland" for entry in installed)
    newer = [
        attrs.evolve(entry, version="99") if entry.distribution == "solidsph-wendland" else entry
        for entry in installed
    ]
    monkeypatch.setattr(task_module, "_installed", lambda restriction: newer)
    now = Task(Csm3()).key, Task(Csm3(), {"kernel": "wendland-c2"}).key
    assert now[0] == keys[0]
    assert now[1] != keys[1]


def test_keys_follow_the_scenes_that_a_case_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    key, scenes = Task(Csm3()).key, Csm3.scenes
    monkeypatch.setattr(
        Csm3,
        "scenes",
        lambda self: {"csm3": attrs.evolve(scenes(self)["csm3"], outputs=1)},
    )
    assert Task(Csm3()).key != key


def test_what_has_no_lasting_description_is_refused() -> None:
    for value in (lambda: 0.0, object()):
        with pytest.raises(SceneError, match="cannot name"):
            plain({"a": [value]})
    assert plain(len) == "builtins:len"
    assert plain(np.float64(0.1)) == plain(0.1) != plain(0.1 + 1e-16)
    assert plain(np.arange(2)) == [0, 1]


# --- from process to process


def test_registered_cases_go_by_name_and_others_pickled(tmp_path: Path) -> None:
    named = Task(Csm3(across=3), {"cover": 2.2}, 4)
    assert "named" in json.loads(encode_task(named))
    assert decode_task(encode_task(named)) == named
    # A tuple would come back as a list, so this one is pickled.
    paired = Task(Csm3(across=3), {"material": {"pair": (1, 2)}})
    for task in (paired, *several(tmp_path, inf)):
        assert "pickle" in json.loads(encode_task(task))
        assert decode_task(encode_task(task)) == task


def test_a_case_that_no_other_process_finds_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @attrs.frozen
    class Local(Odd):
        pass

    journal = Journal(tmp_path / "journal")
    with pytest.raises(SceneError, match=r"cannot name|no other process can find"):
        sweep([Task(Local("log"))], Processes(1), journal)
    monkeypatch.setattr(Odd, "__module__", "__main__")
    with pytest.raises(SceneError, match="no other process can find"):
        sweep(several(tmp_path, 0.1), Processes(1), journal)


def test_other_software_on_the_other_side_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    line = encode_task(Task(Csm3()))
    monkeypatch.setattr(task_module, "version", lambda name: "99.0")
    with pytest.raises(SceneError, match="another version; install the same"):
        decode_task(line)


def test_a_process_that_dies_is_a_failed_point_and_the_rest_goes_on(tmp_path: Path) -> None:
    deeds = "be killed", "leave", "break", "refuse", "talk", "nothing"
    tasks, journal = odd(tmp_path, *deeds), Journal(tmp_path / "journal")
    points = dict(zip(deeds, sweep(tasks, Processes(2), journal), strict=True))
    assert points["be killed"].outcome.startswith("the process ended by signal 9")
    assert points["leave"].outcome == "the process ended with code 3: no more"
    assert points["break"].outcome == "RuntimeError: broken"
    assert points["refuse"].outcome == "refused"
    assert [name for name, point in points.items() if point.finished] == ["talk", "nothing"]
    assert len({process for _, _, process in log(tmp_path)}) == len(deeds)
    assert len(journal.points(tasks)) == 3  # what died, or broke, is tried again


@pytest.mark.validation
def test_peaks_of_memory_do_not_mix(tmp_path: Path) -> None:
    ballast = np.ones(2**26)  # 512 MiB, in this process alone
    (point,) = sweep(several(tmp_path, 0.1), Processes(1), Journal(tmp_path / "journal"))
    assert 2**24 < point.peak_memory < ballast.nbytes


def test_costs_that_hang_on_no_machine_are_identical_on_every_run(tmp_path: Path) -> None:
    tasks = swinging()[::2]
    inline = sweep(tasks, Inline(), Journal(tmp_path / "inline"))
    side_by_side = sweep(tasks, Processes(2), Journal(tmp_path / "processes"))
    assert bare(inline) == bare(side_by_side)
    assert all(point.finished and point.steps > 0 for point in inline)
    assert len({point.pair_evaluations for point in inline}) > 1


# --- killed


@contextmanager
def parent(folder: Path, *deeds: str, hold: int | None = None) -> Iterator[subprocess.Popen[str]]:
    """A process that sweeps: `swinging`, or these deeds; no further than so many that are done."""
    held = [] if hold is None else [str(hold)]
    process = subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "tests.helpers.sweeping", str(folder), *deeds, *held],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def wait_for_line(process: subprocess.Popen[str], end: str) -> None:
    """Until the process has printed a line that ends so."""
    assert process.stdout is not None
    assert any(line.endswith(f"{end}\n") for line in iter(process.stdout.readline, ""))


def runs(process: int) -> bool:
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return False
    return "State:\tZ" not in status  # one that has ended, and that nobody has asked about


def finish(folder: Path) -> tuple[int, int, int]:
    """Sweep on to the end; tasks in all, kept from before, and run now."""
    with parent(folder) as process:
        out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    total, kept, done = (int(number) for number in out.splitlines()[-1].split())
    return total, kept, done


@pytest.mark.validation
def test_killed_in_mid_sweep_and_given_again(tmp_path: Path) -> None:
    tasks, journal = swinging(), Journal(tmp_path / "journal")
    with parent(tmp_path, hold=2) as process:
        wait_for_line(process, "held")
        process.kill()
    before = journal.path.read_bytes()
    assert before.count(b"\n") == 2
    assert finish(tmp_path) == (6, 2, 4)
    assert journal.path.read_bytes().startswith(before)
    assert sorted(json.loads(line)["key"] for line in lines(journal.path)) == sorted(
        task.key for task in tasks
    )
    whole = sweep(tasks, Inline(), Journal(tmp_path / "whole"))
    assert bare(sweep(tasks, Inline(), journal)) == bare(whole)


@pytest.mark.validation
def test_killed_at_many_moments(tmp_path: Path) -> None:
    tasks = swinging()
    whole = sweep(tasks, Inline(), Journal(tmp_path / "whole"))
    chance = random.Random(1)
    cut = []
    for trial in range(6):
        folder = tmp_path / str(trial)
        folder.mkdir()
        journal = Journal(folder / "journal")
        kept = b""
        for after in sorted(chance.sample(range(5), 3)):  # and killed again when it goes on
            with parent(folder, hold=after + 1) as process:
                # Somewhere between the ends of two tasks.
                wait_for_line(process, f" {after - len(journal_keys(kept))}")
                time.sleep(chance.uniform(0.0, 1.0))
                process.kill()
            now = journal.path.read_bytes() if journal.path.exists() else b""
            assert now.startswith(kept)
            kept = now
            cut.append(kept.count(b"\n"))
            assert after <= cut[-1] <= after + 1
        total, old, new = finish(folder)
        assert (total, old, new) == (6, len(journal_keys(kept)), 6 - len(journal_keys(kept)))
        keys = journal_keys(journal.path.read_bytes())
        assert sorted(keys) == sorted(task.key for task in tasks)  # each once
        assert bare(sweep(tasks, Inline(), journal)) == bare(whole)
    print("lines in the journal at each kill:", *cut)
    assert len(set(cut)) > 2  # the moments did differ


def journal_keys(content: bytes) -> Sequence[str]:
    return [json.loads(line)["key"] for line in content.split(b"\n")[:-1]]


@pytest.mark.parametrize(
    "how",
    [
        signal.SIGKILL,
        signal.SIGINT,
        pytest.param(signal.SIGTERM, marks=pytest.mark.validation),  # taken as an interrupt
    ],
)
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="looks at processes in /proc")
def test_no_process_outlives_its_sweep(tmp_path: Path, how: signal.Signals) -> None:
    with parent(tmp_path, "sleep", "hold") as process:
        wait_for(lambda: len(log(tmp_path)) == 2)
        children = [int(child) for _, _, child in log(tmp_path)]
        assert all(runs(child) for child in children)
        process.send_signal(how)
        process.communicate()
        assert process.returncode == -how
        wait_for(lambda: not any(runs(child) for child in children))


def test_what_a_killed_sweep_left_is_removed_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = time.time()
    monkeypatch.setattr(scratch_module, "clock", SimpleNamespace(time=lambda: now))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folders = [tmp_path / f"solidsph-scratch-{name}" for name in ("old", "young", "held")]
    hour_ago = now - 3600.0
    for folder in (*folders, tmp_path / "foreign"):
        folder.mkdir()
        (folder / "record.h5").touch()
        os.utime(folder, (hour_ago, hour_ago))
    os.utime(folders[1], (now, now))
    held = os.open(folders[2], os.O_RDONLY)
    fcntl.flock(held, fcntl.LOCK_EX)
    scratch = ScratchFolder()
    os.close(held)
    left = {"foreign", "solidsph-scratch-young", "solidsph-scratch-held"}
    assert {path.name for path in tmp_path.iterdir()} == {*left, scratch.path.name}
    scratch.close()
    assert {path.name for path in tmp_path.iterdir()} == left
    ScratchFolder().close()
    assert not folders[2].exists()


# --- estimates


def test_no_estimate_without_a_finished_point() -> None:
    tasks = [Task(Csm3(across=n)) for n in (3, 6)]
    estimate = RemainingTime.of(tasks)
    assert estimate.left(1.0, [], tasks) is None
    estimate.learn(tasks[0], Point({}, inf, "diverged", seconds=(1.0,)))
    assert estimate.left(1.0, tasks[:1], tasks[1:]) is None
    assert estimate.left(1.0, tasks, []) == 0.0


def test_estimates_follow_the_power_law_that_is_there() -> None:
    # Particles lie on both faces: these spacings are a half, a quarter and an eighth of the width.
    tasks = [Task(Csm3(across=n)) for n in (3, 5, 9)]
    for exponent in (1.0, 2.5):
        estimate = RemainingTime.of(tasks)
        for task, time_taken in zip(tasks, (3.0, 3.0 * 2.0**exponent), strict=False):
            estimate.learn(task, Point({}, 0.1, seconds=(time_taken,)))
        # Wall time is half of the sum of times: two at a time.
        elapsed = 0.5 * 3.0 * (1.0 + 2.0**exponent)
        left = estimate.left(elapsed, tasks[:2], tasks[2:])
        assert left == pytest.approx(0.5 * 3.0 * 4.0**exponent, rel=1e-9)  # of rounding
    single = RemainingTime.of(tasks)
    single.learn(tasks[0], Point({}, 0.1, seconds=(1.0,)))
    assert single.left(1.0, tasks[:1], tasks[1:]) == pytest.approx(8.0 + 64.0, rel=1e-9)


def test_what_is_timed_already_needs_no_power_law() -> None:
    first, second = (Task(Csm3(across=4), {"precision": word}) for word in ("float32", "float64"))
    estimate = RemainingTime.of([first, second])
    estimate.learn(first, Point({}, 0.1, seconds=(1.0,)))
    estimate.learn(second, Point({}, 0.1, seconds=(5.0,)))
    again = attrs.evolve(second, repeat=1)
    assert estimate.left(1.0, [first], [again]) == pytest.approx(5.0)


def test_the_bar_says_what_failed_and_how_long_it_takes() -> None:
    assert time_left(None) == "time left not known yet"
    assert [time_left(s) for s in (5.2, 600.0, 7200.0)] == [
        "about 5 s left",
        "about 10 min left",
        "about 2.0 h left",
    ]
    shown = io.StringIO()
    task = Task(Csm3(), {"cover": 2.2})
    with Progress(console=Console(file=shown, width=200), disable=False) as display:
        observer = SweepObserver(display, "cost [csm3]")
        observer(SweepStatus(4, 1, 0, None))
        observer(SweepStatus(4, 1, 1, 30.0, task, Point(task.settings, 0.1)))
        observer(SweepStatus(4, 1, 2, 30.0, task, Lost("the process ended by signal 9")))
        (bar,) = display.tasks
    assert (bar.description, bar.total, bar.completed) == ("cost \\[csm3]", 4, 3)
    assert bar.fields["note"] == "about 30 s left, 1 from before"
    assert shown.getvalue().count("cover 2.2: the process ended by signal 9") == 1
    assert shown.getvalue().count("cover 2.2") == 1


# --- the cluster


def test_the_cluster_is_loaded_only_where_it_is_used() -> None:
    loaded = modules_after(
        "import solidsph.cli, solidsph.studies.sweep, solidsph.studies.cluster\n"
        "solidsph.studies.cluster.Cluster('tcp://here:1')"
    )
    assert not {name for name in loaded if name.split(".")[0] in ("dask", "distributed")}


def test_without_dask_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> ModuleType:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(cluster_module, "import_module", missing)
    with pytest.raises(SceneError, match=r"pip install 'solidsph\[cluster\]'"):
        sweep(several(tmp_path, 0.1), Cluster("tcp://here:1"), Journal(tmp_path / "journal"))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nowhere"])
def test_where_no_scheduler_answers(tmp_path: Path, address: str) -> None:
    pytest.importorskip("distributed")
    runner = Cluster(address, patience=1.0)
    with pytest.raises(SceneError, match="no Dask scheduler answers at"):
        sweep(several(tmp_path, 0.1), runner, Journal(tmp_path / "journal"))


@contextmanager
def local_cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    import dask

    # Dask takes who does not answer in time for dead; here nobody is, however busy the machine.
    comm = "distributed.comm.timeouts"
    patient = {
        f"{comm}.connect": HANG,
        f"{comm}.tcp": HANG,
        "distributed.scheduler.worker-ttl": None,
    }
    with (
        dask.config.set(patient),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
    ):
        yield cluster


@pytest.mark.validation
def test_a_worker_killed_in_mid_sweep(tmp_path: Path) -> None:
    # First those that write down how often they are run, then those that have costs.
    tasks = [*several(tmp_path, 0.1, 0.2, 0.3), *swinging()[::2]]
    journal = Journal(tmp_path / "journal")
    with local_cluster() as cluster:
        workers = [nanny.pid for nanny in cluster.workers.values()]
        ended: list[str] = []
        finished_before: list[str] = []

        def kill_one(standing: SweepStatus) -> None:
            if standing.task is not None and isinstance(standing.task.case, Odd):
                ended.append(str(standing.task.case.error))
            if len(ended) == 2 and not finished_before:
                finished_before.extend(ended)
                os.kill(workers[0], signal.SIGKILL)
                wait_for(lambda: workers[0] not in [n.pid for n in cluster.workers.values()])

        points = sweep(tasks, Cluster(cluster.scheduler_address, HANG), journal, kill_one)
    assert sorted(journal.points(tasks)) == sorted(task.key for task in tasks)
    assert len(lines(journal.path)) == len(tasks)
    runs_of = [error for _, error, _ in log(tmp_path)]
    # Nothing that had ended when the worker died is run again.
    assert [runs_of.count(error) for error in finished_before] == [1] * len(finished_before)
    assert len(finished_before) == 2
    for one, other in zip(points, sweep(tasks, Inline(), Journal(tmp_path / "here")), strict=True):
        # Dask lets linear algebra use one thread, which sums in another order.
        assert one.error == pytest.approx(other.error, rel=1e-9)
        assert one.value == pytest.approx(other.value, rel=1e-9)
        alike = {"error": 0.0, "value": 0.0}
        assert bare([attrs.evolve(one, **alike)]) == bare([attrs.evolve(other, **alike)])


@pytest.mark.validation
def test_a_cluster_whose_sweep_is_interrupted_ends_its_tasks(tmp_path: Path) -> None:
    tasks, journal = odd(tmp_path, "nothing", "sleep", "hold"), Journal(tmp_path / "journal")

    def interrupt(standing: SweepStatus) -> None:
        if standing.done == 1:
            wait_for(lambda: len(log(tmp_path)) == 3)
            raise KeyboardInterrupt

    with local_cluster() as cluster:
        with pytest.raises(KeyboardInterrupt):
            sweep(tasks, Cluster(cluster.scheduler_address, HANG), journal, interrupt)
        children = [int(child) for _, _, child in log(tmp_path)]
        wait_for(lambda: not any(runs(child) for child in children))
    assert len(lines(journal.path)) == 1


@pytest.mark.validation
def test_a_scheduler_that_goes_ends_the_sweep_and_not_what_is_finished(tmp_path: Path) -> None:
    tasks, journal = odd(tmp_path, "nothing", "sleep"), Journal(tmp_path / "journal")
    with local_cluster() as cluster:

        def close(standing: SweepStatus) -> None:
            if standing.done == 1:
                cluster.close()

        with pytest.raises(SceneError, match="is gone; finished points are kept"):
            sweep(tasks, Cluster(cluster.scheduler_address, HANG), journal, close)
    assert len(journal.points(tasks)) == 1
