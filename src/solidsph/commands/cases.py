"""solidsph cases: the cases that can be run by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs
import click

from solidsph.commands.console import Table, present
from solidsph.commands.options import Output, options
from solidsph.registry import registry


@click.command()
@options(Output)
def cases(options: Output) -> None:
    """List the cases with their parameters."""
    rows = []
    for name in registry.names("cases"):
        cls = registry.load("cases", name)
        parameters = {
            field.name: field.default for field in attrs.fields(cls) if field.default is not None
        }
        rows.append(
            {"case": name, "title": cls.title, "source": cls.source}
            | {"parameters": parameters, "studies": dict(cls.studies)}
        )
    present({"cases": rows}, _text(rows), as_json=options.as_json)


def _text(rows: Sequence[Mapping[str, Any]]) -> Iterator[Table | str]:
    yield Table.of("cases", rows, ("case", "title", "source"))
    for row in rows:
        listed = ", ".join(f"{name}={value}" for name, value in row["parameters"].items())
        yield f"{row['case']} --set: {listed}"
        for why in dict.fromkeys(row["studies"].values()):
            words = [word for word, reason in row["studies"].items() if reason == why]
            yield f"  names {', '.join(words)}: {why}"
