"""solidsph plot: pictures of a record."""

from __future__ import annotations

from pathlib import Path

import click

from solidsph.commands.console import say, show_json


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--output", type=click.Path(path_type=Path), help="Folder.  [default: beside the record]"
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def plot(result: Path, output: Path | None, as_json: bool) -> None:
    """Draw a record: the motion or the deformed body with its stress, and the energies."""
    from solidsph.results.pictures import draw
    from solidsph.results.record import Record

    with Record(result) as record:
        paths = draw(record, output or result.parent, result.stem)
    if as_json:
        show_json({"record": str(result), "pictures": [str(path) for path in paths]})
        return
    for path in paths:
        say(f"picture: {path}")
