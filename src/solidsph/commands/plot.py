"""solidsph plot: pictures of a record."""

from __future__ import annotations

from pathlib import Path

import attrs
import click

from solidsph.commands.console import present
from solidsph.commands.options import Output, option, options, output_option
from solidsph.commands.records import records_in
from solidsph.results.record import Record


@attrs.frozen
class _Options(Output):
    output: Path | None = output_option("Folder for the pictures.  [default: that of the record]")
    field: str | None = option(
        "Field that colours the body.  [default: the largest principal stress]", metavar="NAME"
    )


@click.command()
@click.argument("result", metavar="RECORD|FOLDER", type=click.Path(path_type=Path))
@options(_Options)
def plot(result: Path, options: _Options) -> None:
    """Draw the pictures of a record, or of all in a FOLDER.

    They show the deformed body, coloured by a field, the energies, and what the probes measured.
    """
    from solidsph.results.pictures import draw

    chosen = {} if options.field is None else {"field": options.field}
    paths: list[str] = []
    for path in records_in(result):
        with Record(path) as record:
            folder = options.output or path.parent
            paths += [str(picture) for picture in draw(record, folder, path.stem, **chosen)]
    facts = {"record": str(result), "pictures": paths}
    present(facts, [f"picture: {path}" for path in paths], as_json=options.as_json)
