"""Tables in HTML, for notebooks: what `_repr_html_` of results gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape


def as_text(value: object) -> str:
    """A value as people read it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def heading(text: str, remark: str = "") -> str:
    """A title, and what is to be said below it."""
    below = f"<div>{escape(remark)}</div>" if remark else ""
    return f"<div><b>{escape(text)}</b></div>{below}"


def of_values(values: Mapping[str, object]) -> str:
    """Table of names and values, one a row."""
    return _table("", [[name, value] for name, value in values.items()])


def of_rows(rows: Sequence[Mapping[str, object]]) -> str:
    """Table of rows that have the same keys; empty if there is none."""
    if not rows:
        return ""
    columns = "".join(f"<th>{escape(str(key))}</th>" for key in rows[0])
    return _table(f"<thead><tr>{columns}</tr></thead>", [list(row.values()) for row in rows])


def _table(head: str, rows: Sequence[Sequence[object]]) -> str:
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"<table>{head}<tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    align = "right" if number else "left"
    return f'<td style="text-align: {align}">{escape(as_text(value))}</td>'
