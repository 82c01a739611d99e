"""solidsph reproduce: the figures of the paper, each beside what it should show."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import click

from solidsph.commands.console import Table, present, progress, progress_observers
from solidsph.commands.options import FILE, Output, flag, option, options, output_option
from solidsph.registry import registry


@attrs.frozen
class _Options(Output):
    listed: bool = flag("List figures and passages with their cases.", "--list")
    output: Path = output_option(
        "Folder for pictures, data and records.", Path("results/reproduce")
    )
    page: Path | None = option(
        "Also write a Markdown page of text and pictures to this file.", type=FILE
    )


@click.command()
@click.argument("wanted", metavar="[FIGURE]...", nargs=-1)
@options(_Options)
def reproduce(wanted: tuple[str, ...], options: _Options) -> None:
    """Reproduce figures of the paper.

    The paper is Ismail & Reddy, Smoothed Particle Hydrodynamics for Nonlinear Solid Mechanics.
    Figures have names such as fig-11; passages that raise a question have names too. Without a
    name, all are reproduced.
    """
    from solidsph.studies.reproduce import figures
    from solidsph.studies.reproduce import reproduce as run_cases

    if options.listed:
        known = [
            {"figure": figure, "case": case, "what": registry.load("cases", case).title}
            for figure, case in figures().items()
        ]
        table = Table.of("figures", known, ("figure", "case", "what"), {"what": "title"})
        present({"figures": known}, [table], as_json=options.as_json)
        return
    begun = clock.perf_counter()
    with progress(options.progress) as display:
        result = run_cases(wanted, options.output, partial(progress_observers, display))
    seconds = clock.perf_counter() - begun
    if options.page is not None:
        from solidsph.studies.gallery import write_gallery

        write_gallery(result, options.page)
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
    present(facts, text, as_json=options.as_json, passed=result.passed)


def _text(facts: Mapping[str, Any], cases: int) -> Iterator[Table | str]:
    rows: Sequence[Mapping[str, Any]] = facts["measurements"]
    columns = ("case", "quantity", "paper", "theory", "measured", "unit", "error", "as expected")
    yield Table.of("the paper, theory and measurement", rows, columns)
    yield from (*facts["pictures"], *facts["tables"])
    yield f"all pictures on one sheet: {facts['contact sheet']}"
    yield f"{cases} cases in {facts['wall time [s]']:.0f} s"
    yield "verdict: " + ("as the sources predict" if facts["passed"] else "NOT as predicted")
