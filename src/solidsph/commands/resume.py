"""solidsph resume: go on with runs that were killed, interrupted or are to be extended."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from solidsph.commands.console import ProgressObserver, progress, say, show_json
from solidsph.errors import RecordError
from solidsph.results.layout import RECORD_SUFFIXES
from solidsph.results.record import Record
from solidsph.run.outcome import UNSOUND

if TYPE_CHECKING:
    from solidsph.resumption import Pending


@click.command()
@click.argument("result", metavar="RECORD|FOLDER", type=click.Path(path_type=Path))
@click.option("--until", type=float, metavar="T", help="A later end than the scene's [s].")
@click.option(
    "--force", is_flag=True, help="Also with other versions, plugins or threads than before."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
def resume(result: Path, until: float | None, force: bool, as_json: bool, quiet: bool) -> None:
    """Go on with a run in its own record, bit for bit; of a folder, with every run in it."""
    from solidsph.resumption import pending

    facts = []
    for path in _records(result):
        found = pending(path, until=until, force=force)
        if found is None:
            facts.append({"record": str(path), "outcome": f"{_outcome(path)} before"})
            if not as_json:
                say(f"{path} is {_outcome(path)}; --until T extends it")
            continue
        facts.append(_carried_out(found, shown=not (as_json or quiet)))
        if not as_json:
            since = facts[-1]["from [s]"]
            anew = "" if found.since.state is not None else ", without a checkpoint"
            say(f"{path} is finished now; it went on from t = {since:.6g} s{anew}")
    unsound = any(one["outcome"].startswith(UNSOUND) for one in facts)
    if as_json:
        show_json({"runs": facts, "exit code": int(unsound)})
    if unsound:
        raise SystemExit(1)


def _outcome(path: Path) -> str:
    with Record(path) as record:
        return record.outcome.partition(":")[0]


def _records(result: Path) -> list[Path]:
    if not result.is_dir():
        return [result]
    found = sorted(path for suffix in RECORD_SUFFIXES for path in result.glob(f"*{suffix}"))
    if not found:
        raise RecordError(f"there is no record (*.h5) in the folder {result}; check the path")
    return found


def _carried_out(found: Pending, *, shown: bool) -> dict[str, Any]:
    with progress(shown) as display:
        observers = (
            [ProgressObserver(display, found.path.stem, found.simulation)] if display else []
        )
        result = found.solve(observers)
    since = found.since.state
    return {
        "record": str(found.path),
        "outcome": "finished",
        "from [s]": 0.0 if since is None else since.time,
        **result.effort,
        "wall time [s]": result.seconds,
    }
