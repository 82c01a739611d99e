"""solidsph reproduce: the figures of the paper, each beside what it should show."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from solidsph.commands.console import ProgressObserver, progress, say, show_json, show_table
from solidsph.registry import registry


@click.command()
@click.argument("wanted", metavar="[FIGURE]...", nargs=-1)
@click.option(
    "--list", "listed", is_flag=True, help="List figures and passages, and what shows them."
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("results/reproduce"),
    show_default=True,
    help="Folder for pictures, data and records.",
)
@click.option(
    "--page",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write a page of text and pictures to this file too.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
def reproduce(
    wanted: tuple[str, ...],
    listed: bool,
    output: Path,
    page: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Reproduce the figures of Ismail & Reddy, and answer what they ask for: all, or those named,
    such as fig-11."""
    from solidsph.studies.reproduce import figures
    from solidsph.studies.reproduce import reproduce as solve

    if listed:
        _list(figures(), as_json)
        return
    begun = clock.perf_counter()
    with progress(not (as_json or quiet)) as display:

        def begin(name: str, simulation: Any) -> Sequence[object]:
            return [ProgressObserver(display, name, simulation)] if display else []

        made = solve(wanted, output, begin)
    seconds = clock.perf_counter() - begun
    if page is not None:
        from solidsph.studies.gallery import write_gallery

        write_gallery(made, page)
    rows = [
        {
            "case": case,
            "quantity": m.quantity,
            "paper": m.paper,
            "theory": m.reference,
            "measured": m.value,
            "unit": m.unit,
            "error": m.error,
            "as expected": m.passed,
        }
        for case, result in made.results.items()
        for m in result.measurements
    ]
    tables = [path for result in made.results.values() for path in result.tables]
    if as_json:
        show_json(
            {
                "passed": made.passed,
                "wall time [s]": seconds,
                "measurements": rows,
                "pictures": [str(path) for path in made.pictures],
                "tables": [str(path) for path in tables],
                "contact sheet": None if made.sheet is None else str(made.sheet),
            }
        )
    else:
        show_table(
            "what the paper says, what theory says, what is measured",
            ["case", "quantity", "paper", "theory", "measured", "unit", "error", "as expected"],
            [list(row.values()) for row in rows],
        )
        for path in (*made.pictures, *tables):
            say(str(path))
        say(f"all pictures at once: {made.sheet}")
        say(f"{len(made.results)} cases in {seconds:.0f} s")
        say("verdict: " + ("as the sources predict" if made.passed else "NOT as predicted"))
    if not made.passed:
        raise SystemExit(1)


def _list(known: Any, as_json: bool) -> None:
    rows = [
        {"figure": figure, "case": case, "what": registry.load("cases", case).title}
        for figure, case in known.items()
    ]
    if as_json:
        show_json({"figures": rows})
        return
    show_table("figures", ["figure", "case", "what"], [list(row.values()) for row in rows])
