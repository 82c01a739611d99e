"""solidsph plugins: the installed parts."""

from __future__ import annotations

import attrs
import click

from solidsph.commands.console import Table, present
from solidsph.commands.options import Output, flag, options
from solidsph.errors import SolidsphError
from solidsph.registry import registry


@attrs.frozen
class _Options(Output):
    load: bool = flag("Import every part, and report those that fail.")


@click.command()
@options(_Options)
def plugins(options: _Options) -> None:
    """List the installed parts and where they come from. Nothing is imported without --load."""
    rows = [
        {
            "kind": registry.singular(kind),
            "name": entry.name,
            "distribution": f"{entry.distribution} {entry.version}",
            "target": entry.target,
            **({"status": _status(kind, entry.name)} if options.load else {}),
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
            **({"status": "not checked"} if options.load else {}),
        }
        for point in registry.hook_points()
    ]
    columns = list(rows[0]) if rows else ["kind", "name"]
    table = Table("installed parts", columns, [list(row.values()) for row in rows])
    present({"plugins": rows}, [table], as_json=options.as_json)


def _status(kind: str, name: str) -> str:
    try:
        registry.load(kind, name)
    except SolidsphError as cause:
        return f"error: {cause}"
    return "ok"
