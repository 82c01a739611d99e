"""solidsph resume: continue runs that were killed or interrupted, or extend finished ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from solidsph.commands.console import present, progress, progress_observers, say
from solidsph.commands.options import json_option, quiet_option
from solidsph.errors import RecordError
from solidsph.results.layout import RECORD_SUFFIXES
from solidsph.results.record import Record
from solidsph.run.outcome import UNSOUND

if TYPE_CHECKING:
    from solidsph.resumption import Pending


@click.command()
@click.argument("result", metavar="RECORD|FOLDER", type=click.Path(path_type=Path))
@click.option("--until", type=float, metavar="T", help="Extend the run to this time [s].")
@click.option(
    "--force", is_flag=True, help="Resume even if versions, plugins or threads have changed."
)
@json_option
@quiet_option
def resume(result: Path, until: float | None, force: bool, as_json: bool, quiet: bool) -> None:
    """Continue a run in its record, bit for bit; or every run in a folder."""
    from solidsph.resumption import pending

    facts = []
    for path in _records(result):
        run = pending(path, until=until, force=force)
        if run is None:
            facts.append({"record": str(path), "outcome": f"{_outcome(path)} before"})
            text = f"{path} is {_outcome(path)}; --until T extends it"
        else:
            facts.append(_resumed(run, shown=not (as_json or quiet)))
            start = f"t = {facts[-1]['from [s]']:.6g} s"
            without = "" if run.since.state is not None else ", for lack of a checkpoint"
            text = f"{path} is finished now; it was resumed at {start}{without}"
        if not as_json:
            say(text)
    unsound = any(entry["outcome"].startswith(UNSOUND) for entry in facts)
    present({"runs": facts, "exit code": int(unsound)}, (), as_json=as_json, passed=not unsound)


def _outcome(path: Path) -> str:
    with Record(path) as record:
        return record.outcome.partition(":")[0]


def _records(result: Path) -> list[Path]:
    if not result.is_dir():
        return [result]
    records = sorted(path for suffix in RECORD_SUFFIXES for path in result.glob(f"*{suffix}"))
    if not records:
        raise RecordError(f"there is no record (*.h5) in the folder {result}; check the path")
    return records


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
