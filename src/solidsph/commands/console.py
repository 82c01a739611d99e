"""Output of the verbs: tables, lines and progress for people, one JSON object for programs."""

from __future__ import annotations

import json
import os
import sys
import time as clock
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import isfinite
from typing import IO, Any, final

import attrs
import click
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table as RichTable

from solidsph.commands.build_line import BuildLine
from solidsph.interfaces.terms import Observation
from solidsph.run.hooks import implementation
from solidsph.run.progress import part_done
from solidsph.simulation import Simulation
from solidsph.studies.sweep import StatusCallback, SweepStatus
from solidsph.system.progress_display import time_left


class _Console(Console):
    """Console that falls silent when its reader ends, as `head` does, so that the work goes on."""

    def on_broken_pipe(self) -> None:
        self.quiet = True
        _discard_output(self.file)


def _discard_output(stream: IO[str]) -> None:
    with suppress(OSError, ValueError):  # no file, or a closed one
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)


# Files and pipes have no width of their own; this one fits the widest table. COLUMNS sets another.
_WIDE = None if sys.stdout.isatty() or "COLUMNS" in os.environ else 170

out = _Console(highlight=False, width=_WIDE)
err = _Console(stderr=True, highlight=False)


# Width that columns of words keep where a table is wider than the terminal.
_LEAST = 16


@attrs.frozen
class Table:
    """A table for people."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]

    @classmethod
    def of(
        cls,
        title: str,
        records: Sequence[Mapping[str, Any]],
        keys: Sequence[str],
        headings: Mapping[str, str] | None = None,
    ) -> Table:
        """Table of some keys of `records`, under headings that may differ from them."""
        columns = [(headings or {}).get(key, key) for key in keys]
        return cls(title, columns, [[record[key] for key in keys] for record in records])

    @classmethod
    def of_values(cls, title: str, values: Mapping[str, Any], name: str = "") -> Table:
        """Table of names and values, one a row."""
        return cls(title, [name, "value"], list(values.items()))

    def show(self) -> None:
        """Print it; numbers are right-aligned and rounded for reading."""
        cells = [[_text(cell) for cell in row] for row in self.rows]
        columns = [[row[index] for row in cells] for index in range(len(self.columns))]
        wide = sum(_longest([name, *columns[i]]) + 3 for i, name in enumerate(self.columns))
        numeric = [self._is_numeric(index) for index in range(len(self.columns))]
        # Numbers are never cut to fit, their headings break between words; words wrap.
        least = [
            _longest([*name.split(), *cells])
            if numbers
            else min(_LEAST, _longest([word for text in (name, *cells) for word in text.split()]))
            for name, cells, numbers in zip(self.columns, columns, numeric, strict=True)
        ]
        crowded = sum(least) + 3 * len(least) + 1 > out.width
        table = RichTable(
            title=escape(self.title),
            title_justify="left",
            header_style="bold",
            padding=(0, 0) if crowded else (0, 1),
        )
        for name, numbers, width in zip(self.columns, numeric, least, strict=True):
            table.add_column(
                escape(name.replace(" ", "\n") if numbers and wide >= out.width else name),
                justify="right" if numbers else "left",
                no_wrap=numbers,
                overflow="fold",
                min_width=width,
            )
        for row in cells:
            table.add_row(*map(escape, row))
        out.print(table)

    def _is_numeric(self, index: int) -> bool:
        """Whether a column holds numbers, and at least one."""
        values = [row[index] for row in self.rows if row[index] not in ("", None)]
        return bool(values) and all(map(_is_number, values))


def present(
    facts: Mapping[str, Any],
    text: Iterable[Table | str],
    *,
    as_json: bool,
    passed: bool = True,
) -> None:
    """Print `facts` as one JSON object, or else the tables and lines of `text`.

    Raises:
        SystemExit: the check or run has not passed; the exit code is 1.
    """
    if as_json:
        ended = {"outcome": "finished" if passed else "failed", "exit code": 0 if passed else 1}
        show_json({**facts, **{key: facts.get(key, known) for key, known in ended.items()}})
    else:
        for block in text:
            say(block) if isinstance(block, str) else block.show()
    if not passed:
        raise SystemExit(1)


def say(text: str) -> None:
    """Print plain text, brackets included, on the standard output.

    On a terminal lines break between words; in files and pipes they are whole.
    """
    out.print(escape(text), soft_wrap=not out.is_terminal)


def show_json(data: Mapping[str, Any]) -> None:
    """Print one JSON object on the standard output."""
    try:
        sys.stdout.write(json.dumps(_jsonable(data), indent=2, allow_nan=False) + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_output(sys.stdout)


def known_facts() -> dict[str, Any]:
    """Entries of the JSON object that are printed even if the verb fails; to be filled by it."""
    context = click.get_current_context(silent=True)
    facts: dict[str, Any] = {} if context is None else context.ensure_object(dict)
    return facts


@final
class _Display(Progress):
    """Bars of runs, and while a scene is built the line that says what is done."""

    def __init__(self, *columns: ProgressColumn, line: BuildLine, **settings: Any) -> None:
        """Show the `columns` of every run; `settings` are those of `Progress`."""
        self._line = line
        super().__init__(*columns, **settings)

    def get_renderables(self) -> Iterator[RenderableType]:
        if not self.tasks:
            yield self._line.text()
            return
        if text := self._line.text():
            yield text
        yield self.make_tasks_table(self.tasks)


@contextmanager
def progress(shown: bool, column: ProgressColumn | None = None) -> Iterator[Progress | None]:
    """Progress display on the standard error; None unless `shown` and on a terminal.

    Builds within the block are shown too.

    Args:
        shown: whether it is wanted.
        column: the last one, by default the time remaining.
    """
    if not (shown and err.is_terminal):
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    last, line = column or TimeRemainingColumn(), BuildLine(clock.monotonic)
    with (
        line.listening(),
        _Display(*columns, last, line=line, console=err, transient=True) as display,
    ):
        yield display


def progress_observers(
    display: Progress | None, description: str, simulation: Simulation
) -> Sequence[object]:
    """Observers that show the progress of a run; none without a display."""
    return [ProgressObserver(display, description, simulation)] if display else []


class ProgressObserver:
    """Observer that advances a progress bar at every output of a run."""

    def __init__(self, display: Progress, description: str, simulation: Simulation) -> None:
        self._display = display
        moves = simulation.scene.statics is None
        self._steps = simulation.steps if moves else simulation.load_steps
        self._task = display.add_task(description, total=self._steps)

    @implementation
    def solidsph_step_end(self, simulation: Simulation, observation: Observation) -> None:
        part = part_done(simulation, observation)
        self._display.update(self._task, completed=round(part * self._steps))


@contextmanager
def sweep_progress(description: str, shown: bool) -> Iterator[StatusCallback]:
    """Callback that shows the progress of a sweep, as `progress` does for a run."""
    with progress(shown, TextColumn("{task.fields[note]}")) as display:
        yield SweepObserver(display, description) if display else lambda status: None


class SweepObserver:
    """Callback that advances a progress bar after every task of a sweep and prints failures."""

    def __init__(self, display: Progress, description: str) -> None:
        self._display = display
        self._task = display.add_task(escape(description), total=None, note="")

    def __call__(self, status: SweepStatus) -> None:
        point = status.point
        if point is not None and not point.ran:
            self._display.console.print(escape(f"{point.label()}: {point.failure}"))
        kept = f", {status.kept} from before" if status.kept else ""
        self._display.update(
            self._task,
            total=status.total,
            completed=status.total - status.remaining,
            note=f"{time_left(status.seconds_left)}{kept}",
        )


def _longest(texts: Iterable[str]) -> int:
    return max(map(len, texts), default=0)


def _is_number(cell: Any) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def _text(cell: Any) -> str:
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return f"{cell:.5g}"
    return "" if cell is None else str(cell)


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _jsonable(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_jsonable(item) for item in value]
    if isinstance(value, float):
        return value if isfinite(value) else str(value)  # JSON has no infinity
    return value if isinstance(value, (bool, int, str)) or value is None else str(value)
