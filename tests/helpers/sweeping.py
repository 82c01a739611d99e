"""What tests of sweeps need in several processes: odd cases, and a sweep to be killed."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import attrs

from solidsph.errors import SceneError
from solidsph.studies.case import Case, Measurement
from solidsph.studies.journal import Journal
from solidsph.studies.processes import Processes
from solidsph.studies.sweep import SweepStatus, sweep
from solidsph.studies.task import Task
from solidsph.studies.variant import with_settings
from solidsph_cases.csm3 import Csm3
from tests.helpers.waiting import HANG


def _refuse() -> None:
    raise SceneError("refused")


def _break() -> None:
    raise RuntimeError("broken")


def _hold() -> None:
    ctypes.PyDLL(None).sleep(int(HANG))  # no thread of Python runs meanwhile, as in a compiled loop


DEEDS: Mapping[str, Callable[[], object]] = {
    "nothing": lambda: None,
    "talk": lambda: (print("noise"), os.write(1, b"more noise\n")),
    "be killed": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "leave": lambda: (sys.stderr.write("no more\n"), sys.stderr.flush(), os._exit(3)),
    "break": _break,
    "refuse": _refuse,
    "sleep": lambda: time.sleep(HANG),
    "hold": _hold,
}


@attrs.frozen
class Odd(Case):
    """Runs nothing; writes down that it was run, and by whom, and does something odd."""

    title: ClassVar[str] = "an odd case"
    source: ClassVar[str] = "nowhere"

    log: str
    deed: str = "nothing"
    error: float = 0.5

    resolution: ClassVar[float] = 1.0  # type: ignore[assignment]  # it has no particles

    def scenes(self):
        return {}

    def measure(self, records):
        with Path(self.log).open("a") as log:
            log.write(f"{self.deed} {self.error} {os.getpid()}\n")
        DEEDS[self.deed]()
        return [Measurement("oddity", 1.0, "1", 1.0, error=self.error)]

    def draw(self, records, folder):
        return []


def odd(folder: Path, *deeds: str) -> Sequence[Task]:
    """A task for each deed."""
    return [Task(Odd(str(folder / "log"), deed)) for deed in deeds]


def several(folder: Path, *errors: float) -> Sequence[Task]:
    """A task for each error."""
    return [Task(Odd(str(folder / "log"), error=error)) for error in errors]


def swinging() -> Sequence[Task]:
    """Short runs of a beam."""
    case = with_settings(Csm3(across=3, duration=0.005), {"engine": "matrix"})
    return [Task(case, {"cover": cover}, repeat) for cover in (2.3, 2.2, 2.6) for repeat in (0, 1)]


def tell(standing: SweepStatus, hold: int | None = None) -> None:
    """Print how far a sweep is; once so many are done or kept, wait to be killed."""
    print(standing.total, standing.kept, standing.done, flush=True)
    if standing.kept + standing.done == hold:
        print("held", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    from tests.helpers import sweeping  # where other processes find what is defined here

    place, *wanted = sys.argv[1:]
    hold = int(wanted.pop()) if wanted and wanted[-1].isdecimal() else None
    tasks = sweeping.odd(Path(place), *wanted) if wanted else swinging()
    journal = Journal(Path(place) / "journal")
    sweep(tasks, Processes(2), journal, lambda standing: tell(standing, hold))
