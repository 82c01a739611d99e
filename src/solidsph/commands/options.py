"""Options of the verbs, declared once as fields of attrs classes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path
from typing import Any

import attrs
import click

from solidsph.commands.verbosity import say_from

FILE = click.Path(path_type=Path, dir_okay=False)


def option(text: str, *names: str, **settings: Any) -> Any:
    """Field that is an option of its name.

    Args:
        text: its help.
        names: on the command line, if different from that of the field.
        settings: further arguments of `click.option`.
    """
    default = settings.get("default", () if settings.get("multiple") else None)
    return attrs.field(default=default, metadata={"names": names, "help": text, **settings})


def flag(text: str, *names: str) -> Any:
    """Field that is an option without a value; arguments as for `option`."""
    return option(text, *names, is_flag=True, default=False)


def set_option(of: str = "the case, or a word or key of the scene") -> Any:
    """Field for `--set NAME=VALUE`, of a case, a scene or a part."""
    return option(f"Set a parameter of {of}.", "--set", multiple=True, metavar="NAME=VALUE")


def output_option(text: str, default: Path | None = None) -> Any:
    """Field for `--output`, a folder; without a default the verb chooses it."""
    path = click.Path(path_type=Path)
    return option(text, "--output", type=path, default=default, show_default=default is not None)


@attrs.frozen
class Output:
    """Options of every verb."""

    as_json: bool = flag("Print one JSON object instead of text.", "--json")
    verbosity: int = option(
        "Say what is done, and show internals in tables, such as the engine and memory traffic; "
        "-vv says every detail.",
        *("-v", "--verbose"),
        count=True,
        default=0,
    )
    quiet: bool = flag("Show results and errors only: no progress, no warnings.", "-q", "--quiet")

    @property
    def verbose(self) -> bool:
        """Whether internals are shown."""
        return self.verbosity > 0

    @property
    def progress(self) -> bool:
        """Whether progress is shown."""
        return not (self.as_json or self.quiet)


@attrs.frozen
class SearchOptions:
    """Options of every verb that searches for an accuracy."""

    of: tuple[str, ...] = option(
        "Be accurate in this column of a scene's history, or this probe; before it may stand "
        "final, peak or mean.  [default: all probes]",
        "--of",
        multiple=True,
        metavar="[peak] NAME",
    )
    longest: str = option(
        "A search runs nothing that is expected to take longer.",
        default="10min",
        show_default=True,
        metavar="TIME",
    )


def option_group(cls: type[Any]) -> Any:
    """Field that holds further options, those of `cls`."""
    return attrs.field(factory=cls, metadata={"group": cls})


def options(cls: type[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator of a verb that adds the options of a subclass of `Output`, and passes an object."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        @wraps(function)
        def command(**values: Any) -> None:
            before = click.get_current_context().find_root().params  # solidsph -q VERB
            values["verbosity"] += before.get("verbosity", 0)
            values["quiet"] |= before.get("quiet", False)
            say_from(values["verbosity"], values["quiet"])
            function(options=_collected(cls, values), **values)

        for field in reversed(list(_fields(cls))):  # click lists the last one applied first
            settings = dict(field.metadata)
            names = settings.pop("names") or (f"--{field.name.replace('_', '-')}",)
            click.option(*names, field.name, **settings)(command)
        return command

    return decorate


def _fields(cls: type[Any]) -> Iterator[attrs.Attribute[Any]]:
    """Options of a class in the order of its help: inherited ones come last."""
    for field in sorted(attrs.fields(cls), key=lambda field: field.inherited):
        inner = field.metadata.get("group")
        yield from _fields(inner) if inner else (field,)


def _collected(cls: type[Any], values: dict[str, Any]) -> Any:
    """Object of a class of options, whose values are taken out of `values`."""
    taken = {}
    for field in attrs.fields(cls):
        inner = field.metadata.get("group")
        taken[field.name] = _collected(inner, values) if inner else values.pop(field.name)
    return cls(**taken)
