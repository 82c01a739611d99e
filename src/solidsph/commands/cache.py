"""solidsph cache: compiled functions on disk."""

from __future__ import annotations

import attrs
import click

from solidsph.commands.console import Table, present
from solidsph.commands.options import Output, flag, options
from solidsph.system.cache import COMPILATIONS, COMPILED


@attrs.frozen
class _Options(Output):
    clear: bool = flag("Delete them.")


@click.command()
@options(_Options)
def cache(options: _Options) -> None:
    """Show or clear the compiled functions on disk.

    A run that needs the same functions as an earlier one reads them instead of compiling them. They
    may be deleted at any time.
    """
    if options.clear:
        COMPILED.clear()
        COMPILATIONS.clear()
    sizes = [size for _, size in COMPILED.entries]
    facts = {
        "folder": str(COMPILED.folder),
        "entries": len(sizes),
        "size [MiB]": sum(sizes) / 2**20,
        "bound [MiB]": COMPILED.largest / 2**20,
    }
    present(facts, [Table.of_values("compiled functions", facts)], as_json=options.as_json)
