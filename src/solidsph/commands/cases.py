"""solidsph cases: what can be run by name."""

from __future__ import annotations

import attrs
import click

from solidsph.commands.console import say, show_json, show_table
from solidsph.registry import registry


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table.")
def cases(as_json: bool) -> None:
    """List the cases that can be run by name, with their parameters."""
    rows = []
    for name in registry.names("cases"):
        cls = registry.load("cases", name)
        parameters = {
            field.name: field.default for field in attrs.fields(cls) if field.default is not None
        }
        rows.append(
            {"case": name, "title": cls.title, "source": cls.source, "parameters": parameters}
        )
    if as_json:
        show_json({"cases": rows})
        return
    show_table("cases", ["case", "what", "source"], [list(row.values())[:3] for row in rows])
    for row in rows:
        listed = ", ".join(f"{name}={value}" for name, value in row["parameters"].items())
        say(f"{row['case']} --set: {listed}")
