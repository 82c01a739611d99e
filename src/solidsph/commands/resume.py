"""solidsph resume: continue runs that were killed or interrupted, or extend finished ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import click

from solidsph.commands.console import present, progress, progress_observers, say
from solidsph.commands.options import Output, flag, option, options
from solidsph.commands.records import records_in
from solidsph.results.record import Record
from solidsph.resumption import Pending, pending
from solidsph.run.outcome import UNSOUND


@attrs.frozen
class _Options(Output):
    until: float | None = option("Extend the run to this time [s].", type=float, metavar="T")
    force: bool = flag("Resume even if versions, plugins, files or threads have changed.")


@click.command()
@click.argument("result", metavar="RECORD|FOLDER", type=click.Path(path_type=Path))
@options(_Options)
def resume(result: Path, options: _Options) -> None:
    """Continue the run of a record. The result is the same to the bit as without interruption.

    A FOLDER continues every run in it.
    """
    facts = []
    for path in records_in(result):
        with progress(options.progress):
            run = pending(path, until=options.until, force=options.force)
        if run is None:
            facts.append({"record": str(path), "outcome": f"{_outcome(path)} before"})
            text = f"{path} is {_outcome(path)}; --until T extends it"
        else:
            facts.append(_resumed(run, shown=options.progress))
            start = f"t = {facts[-1]['from [s]']:.6g} s"
            without = "" if run.since.state is not None else ", for lack of a checkpoint"
            text = f"{path} is finished now; it was resumed at {start}{without}"
        if not options.as_json:
            say(text)
    unsound = any(entry["outcome"].startswith(UNSOUND) for entry in facts)
    present(
        {"runs": facts, "exit code": int(unsound)}, (), as_json=options.as_json, passed=not unsound
    )


def _outcome(path: Path) -> str:
    with Record(path) as record:
        return record.outcome.partition(":")[0]


def _resumed(run: Pending, *, shown: bool) -> dict[str, Any]:
    with progress(shown) as display:
        result = run.solve(progress_observers(display, run.path.stem, run.simulation))
    start = run.since.state
    return {
        "record": str(run.path),
        "outcome": "finished",
        "from [s]": 0.0 if start is None else start.time,
        **result.effort,
        "wall time [s]": result.seconds,
    }
