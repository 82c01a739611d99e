"""Tables of errors that were estimated by refinement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from solidsph.commands.console import Table
from solidsph.studies.limit import Limit
from solidsph.studies.point import Point, measured

ESTIMATED = "estimated by refinement: what the values tend to, and the error of the finest"
"""Title of a table of limits."""


def limit_rows(limits: Sequence[Limit]) -> Sequence[Mapping[str, Any]]:
    """A row for every quantity: the value at the finest spacing, and what it tends to."""
    return [
        {
            "quantity": limit.quantity,
            "finest": limit.finest,
            "tends to": limit.value if limit.in_sight else None,
            "order": limit.order,
            "error [%]": 100.0 * limit.bar,
            "warning": limit.warning,
        }
        for limit in limits
    ]


def measured_table(points: Sequence[Point]) -> Iterator[Table]:
    """What the runs that finished have measured, where no error is known."""
    rows = measured(points)
    if rows:
        yield Table.of("measured, by the runs that finished", rows, list(rows[0]))


def with_warnings(title: str, rows: Sequence[Mapping[str, Any]]) -> Iterator[Table | str]:
    """Those rows as a table, and below it what is to be known of some of them."""
    if not rows:
        return
    yield Table.of(title, rows, [key for key in rows[0] if key != "warning"])
    for row in rows:
        if row["warning"]:
            yield f"{row['quantity']}: {row['warning']}"
