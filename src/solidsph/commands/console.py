"""How commands speak: tables and progress for people, one JSON object for programs."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import isfinite
from typing import IO, TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from solidsph.run.hooks import implementation

if TYPE_CHECKING:
    from solidsph.interfaces.terms import Observation
    from solidsph.simulation import Simulation
    from solidsph.studies.sweep import StatusCallback, SweepStatus


class _Console(Console):
    """One whose reader may go away, as `head` does: the work goes on, and is no failure."""

    def on_broken_pipe(self) -> None:
        self.quiet = True
        _stop_writing(self.file)


def _stop_writing(stream: IO[str]) -> None:
    """What is still written to the `stream` goes nowhere."""
    with suppress(OSError, ValueError):  # no file, or a closed one
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


# Where no terminal gives a width, a file or a pipe has room for the widest table.
out = _Console(highlight=False, width=None if sys.stdout.isatty() else 170)
err = _Console(stderr=True, highlight=False)


def say(text: str) -> None:
    """One line of plain text, whatever brackets it holds."""
    out.print(escape(text), soft_wrap=True)


def show_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """A table; numbers are right-aligned and shortened to what a person reads."""
    table = Table(title=escape(title), title_justify="left", header_style="bold")
    for index, column in enumerate(columns):
        numeric = bool(rows) and all(_is_number(row[index]) or row[index] == "" for row in rows)
        # Numbers are never cut to fit; words may wrap.
        table.add_column(escape(column), justify="right" if numeric else "left", no_wrap=numeric)
    for row in rows:
        table.add_row(*(escape(_shown(cell)) for cell in row))
    out.print(table)


def show_json(data: Mapping[str, Any]) -> None:
    """One JSON object on the standard output."""
    try:
        sys.stdout.write(json.dumps(_jsonable(data), indent=2, allow_nan=False) + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        _stop_writing(sys.stdout)


def facts() -> dict[str, Any]:
    """What the object of --json holds whatever the outcome; a verb enters what it knows so far."""
    context = click.get_current_context(silent=True)
    found: dict[str, Any] = {} if context is None else context.ensure_object(dict)
    return found


@contextmanager
def progress(shown: bool) -> Iterator[Progress | None]:
    """A progress display on the standard error, if it is wanted and someone watches."""
    if not (shown and err.is_terminal):
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeRemainingColumn(), console=err, transient=True) as display:
        yield display


class ProgressObserver:
    """Moves a progress bar on at every output of a run."""

    def __init__(self, display: Progress, description: str, simulation: Simulation) -> None:
        self._display = display
        statics = simulation.scene.statics
        self._steps = simulation.steps if statics is None else statics.load_steps
        self._task = display.add_task(description, total=self._steps)

    @implementation
    def solidsph_step_end(self, simulation: Simulation, observation: Observation) -> None:
        # By time, and not by counting: load steps are halved and doubled on the way.
        moves = simulation.scene.statics is None
        end = simulation.steps * simulation.step_size if moves else simulation.scene.duration
        part = observation.state.time / end
        self._display.update(self._task, completed=round(part * self._steps))


@contextmanager
def sweep_progress(description: str, shown: bool) -> Iterator[StatusCallback]:
    """Shows how far a sweep is, on the standard error, if it is wanted and someone watches."""
    if not (shown and err.is_terminal):
        yield lambda standing: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TextColumn("{task.fields[note]}"), console=err, transient=True) as bar:
        yield SweepObserver(bar, description)


class SweepObserver:
    """Moves a progress bar on whenever a task of a sweep has ended; shows those that failed."""

    def __init__(self, display: Progress, description: str) -> None:
        self._display = display
        self._task = display.add_task(escape(description), total=None, note="")

    def __call__(self, standing: SweepStatus) -> None:
        point = standing.point
        if point is not None and not point.finished:
            self._display.console.print(escape(f"{point.label()}: {point.outcome}"))
        kept = f", {standing.kept} from before" if standing.kept else ""
        self._display.update(
            self._task,
            total=standing.total,
            completed=standing.total - standing.remaining,
            note=f"{time_left(standing.seconds_left)}{kept}",
        )


def time_left(seconds: float | None) -> str:
    """An estimate as a person would say it."""
    if seconds is None:
        return "time left not known yet"
    if seconds < 90.0:
        return f"about {seconds:.0f} s left"
    if seconds < 5400.0:
        return f"about {seconds / 60.0:.0f} min left"
    return f"about {seconds / 3600.0:.1f} h left"


def _is_number(cell: Any) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def _shown(cell: Any) -> str:
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return f"{cell:.5g}"
    return "" if cell is None else str(cell)


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _jsonable(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_jsonable(one) for one in value]
    if isinstance(value, (bool, int, str)) or value is None:
        return value
    if isinstance(value, float):
        return value if isfinite(value) else str(value)  # JSON has no infinity
    return str(value)
