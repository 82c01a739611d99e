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
@click.option(
    "--field", metavar="NAME", help="What to colour by.  [default: the largest principal stress]"
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def plot(result: Path, output: Path | None, field: str | None, as_json: bool) -> None:
    """Draw a record: the motion or the deformed body with its stress or another field, and the
    energies."""
    from solidsph.results.pictures import draw
    from solidsph.results.record import Record

    with Record(result) as record:
        chosen = {} if field is None else {"field": field}
        paths = draw(record, output or result.parent, result.stem, **chosen)
    if as_json:
        show_json({"record": str(result), "pictures": [str(path) for path in paths]})
        return
    for path in paths:
        say(f"picture: {path}")
