"""solidsph plot: pictures of a record."""

from __future__ import annotations

from pathlib import Path

import click

from solidsph.commands.console import present
from solidsph.commands.options import json_option, output_option


@click.command()
@click.argument("result", metavar="RECORD", type=click.Path(path_type=Path))
@output_option("Folder for the pictures.  [default: that of the record]")
@click.option(
    "--field",
    metavar="NAME",
    help="Field that colours the body.  [default: the largest principal stress]",
)
@json_option
def plot(result: Path, output: Path | None, field: str | None, as_json: bool) -> None:
    """Draw a record: the motion or the deformed body, coloured by a field, and the energies."""
    from solidsph.results.pictures import draw
    from solidsph.results.record import Record

    with Record(result) as record:
        chosen = {} if field is None else {"field": field}
        paths = [str(p) for p in draw(record, output or result.parent, result.stem, **chosen)]
    facts = {"record": str(result), "pictures": paths}
    present(facts, [f"picture: {path}" for path in paths], as_json=as_json)
