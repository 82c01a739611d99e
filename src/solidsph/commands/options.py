"""Options that several verbs share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON object instead of text."
)

quiet_option = click.option("--quiet", is_flag=True, help="Show no progress.")

verbose_option = click.option(
    "--verbose", is_flag=True, help="Also show internals: engine, time loop, memory traffic."
)

settings_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Set a parameter of the case, or of the part that is checked.",
)


def output_option(text: str, default: str | None = None) -> Callable[[Command], Command]:
    """`--output FOLDER` with a help text, and its default unless the verb chooses it."""
    return click.option(
        "--output",
        type=click.Path(path_type=Path),
        default=None if default is None else Path(default),
        show_default=default is not None,
        help=text,
    )
