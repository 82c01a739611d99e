"""Warnings ahead of a run, as one short block on the standard error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.markup import escape

from solidsph.advice import Advice
from solidsph.commands.console import err


def warn(advice: Mapping[str, Sequence[Advice]]) -> None:
    """Say what there is to say of each scene; the run goes on."""
    for scene, several in advice.items():
        for one in several:
            where = f"{scene}, " if scene else ""
            text = f"warning, {where}{one.name}: {one.finding}. Remedy: {one.remedy}"
            err.print(escape(text), soft_wrap=True)
    if any(advice.values()):
        err.print(
            escape('(more: solidsph explain; to silence: silence = ["NAME"])'), soft_wrap=True
        )
