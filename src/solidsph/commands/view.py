"""solidsph view: a record in three dimensions."""

from __future__ import annotations

from pathlib import Path

import attrs
import click

from solidsph.commands.console import present
from solidsph.commands.options import FILE, Output, option, options
from solidsph.commands.records import records_in
from solidsph.errors import RecordError
from solidsph.results.record import Record


@attrs.frozen
class _Options(Output):
    field: str = option(
        "Field that colours the particles.",
        default="cauchy_stress",
        show_default=True,
        metavar="NAME",
    )
    time: float | None = option(
        "Time that is shown first, the nearest output.  [default: the last]",
        type=float,
        metavar="SECONDS",
    )
    factor: float = option(
        "Magnify the displacements.", type=float, default=1.0, show_default=True, metavar="FACTOR"
    )
    picture: Path | None = option("Draw this file instead of opening a window.", type=FILE)


@click.command()
@click.argument("result", metavar="RECORD|FOLDER", type=click.Path(path_type=Path))
@options(_Options)
def view(result: Path, options: _Options) -> None:
    """Show a record in 3D, with sliders for time and deformation.

    A FOLDER must hold one record only.
    """
    from solidsph.results.view import view as show

    several = records_in(result)
    if len(several) > 1:
        names = ", ".join(path.name for path in several)
        raise RecordError(f"the folder {result} has several records ({names}); name one of them")
    with Record(several[0]) as record:
        show(
            record,
            field=options.field,
            time=options.time,
            factor=options.factor,
            picture=options.picture,
        )
    facts = {"record": str(result), "picture": options.picture and str(options.picture)}
    text = [] if options.picture is None else [f"picture: {options.picture}"]
    present(facts, text, as_json=options.as_json)
