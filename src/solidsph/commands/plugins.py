"""solidsph plugins: the installed parts."""

from __future__ import annotations

import click

from solidsph.commands.console import Table, present
from solidsph.commands.options import json_option
from solidsph.errors import SolidsphError
from solidsph.registry import registry


@click.command()
@click.option("--load", is_flag=True, help="Import every part, and report those that fail.")
@json_option
def plugins(load: bool, as_json: bool) -> None:
    """List the installed parts and where they come from. Nothing is imported without --load."""
    rows = [
        {
            "kind": registry.singular(kind),
            "name": entry.name,
            "distribution": f"{entry.distribution} {entry.version}",
            "target": entry.target,
            **({"status": _status(kind, entry.name)} if load else {}),
        }
        for kind in registry.INTERFACES
        for entry in registry.available(kind)
    ]
    rows += [
        {
            "kind": "hook",
            "name": point.name,
            "distribution": f"{point.dist.name} {point.dist.version}" if point.dist else "",
            "target": point.value,
            **({"status": "not checked"} if load else {}),
        }
        for point in registry.hook_points()
    ]
    columns = list(rows[0]) if rows else ["kind", "name"]
    table = Table("installed parts", columns, [list(row.values()) for row in rows])
    present({"plugins": rows}, [table], as_json=as_json)


def _status(kind: str, name: str) -> str:
    try:
        registry.load(kind, name)
    except SolidsphError as cause:
        return f"error: {cause}"
    return "ok"
