"""solidsph plugins: what is installed."""

from __future__ import annotations

import click

from solidsph.commands.console import show_json, show_table
from solidsph.errors import SolidsphError
from solidsph.registry import registry


@click.command()
@click.option("--load", is_flag=True, help="Import every part, and say which cannot be.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table.")
def plugins(load: bool, as_json: bool) -> None:
    """List every installed part, and where it comes from. Imports none unless told to."""
    rows = []
    for kind in registry.INTERFACES:
        for entry in registry.available(kind):
            row = {
                "kind": registry.singular(kind),
                "name": entry.name,
                "distribution": f"{entry.distribution} {entry.version}",
                "target": entry.target,
            }
            if load:
                row["status"] = _status(kind, entry.name)
            rows.append(row)
    for point in registry.hook_points():
        distribution = f"{point.dist.name} {point.dist.version}" if point.dist else ""
        row = {
            "kind": "hook",
            "name": point.name,
            "distribution": distribution,
            "target": point.value,
        }
        rows.append({**row, "status": "not checked"} if load else row)
    if as_json:
        show_json({"plugins": rows})
        return
    columns = list(rows[0]) if rows else ["kind", "name"]
    show_table("installed parts", columns, [list(row.values()) for row in rows])


def _status(kind: str, name: str) -> str:
    try:
        registry.load(kind, name)
    except SolidsphError as cause:
        return f"error: {cause}"
    return "ok"
