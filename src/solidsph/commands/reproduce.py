"""solidsph reproduce: the figures of the paper, each beside what it should show."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from solidsph.commands.console import Table, present, progress, progress_observers
from solidsph.commands.options import json_option, output_option, quiet_option
from solidsph.registry import registry


@click.command()
@click.argument("wanted", metavar="[FIGURE]...", nargs=-1)
@click.option("--list", "listed", is_flag=True, help="List figures and passages with their cases.")
@output_option("Folder for pictures, data and records.", "results/reproduce")
@click.option(
    "--page",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Also write a Markdown page of text and pictures to this file.",
)
@json_option
@quiet_option
def reproduce(
    wanted: tuple[str, ...],
    listed: bool,
    output: Path,
    page: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Reproduce figures of Ismail & Reddy, such as fig-11, and answer the questions that its
    passages raise. Without names: all of them."""
    from solidsph.studies.reproduce import figures
    from solidsph.studies.reproduce import reproduce as run_cases

    if listed:
        known = [
            {"figure": figure, "case": case, "what": registry.load("cases", case).title}
            for figure, case in figures().items()
        ]
        columns = {"figure": "figure", "case": "case", "title": "what"}
        present({"figures": known}, [Table.of("figures", known, columns)], as_json=as_json)
        return
    begun = clock.perf_counter()
    with progress(not (as_json or quiet)) as display:
        result = run_cases(wanted, output, partial(progress_observers, display))
    seconds = clock.perf_counter() - begun
    if page is not None:
        from solidsph.studies.gallery import write_gallery

        write_gallery(result, page)
    facts = {
        "passed": result.passed,
        "wall time [s]": seconds,
        "measurements": [
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
            for case, outcome in result.results.items()
            for m in outcome.measurements
        ],
        "pictures": [str(path) for path in result.pictures],
        "tables": [str(path) for each in result.results.values() for path in each.tables],
        "contact sheet": None if result.sheet is None else str(result.sheet),
    }
    text = _text(facts, len(result.results))
    present(facts, text, as_json=as_json, passed=result.passed)


def _text(facts: Mapping[str, Any], cases: int) -> Iterator[Table | str]:
    rows: Sequence[Mapping[str, Any]] = facts["measurements"]
    columns = ("case", "quantity", "paper", "theory", "measured", "unit", "error", "as expected")
    yield Table.of("the paper, theory and measurement", rows, columns)
    yield from (*facts["pictures"], *facts["tables"])
    yield f"all pictures on one sheet: {facts['contact sheet']}"
    yield f"{cases} cases in {facts['wall time [s]']:.0f} s"
    yield "verdict: " + ("as the sources predict" if facts["passed"] else "NOT as predicted")
