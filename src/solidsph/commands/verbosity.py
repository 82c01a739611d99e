"""How much a verb says on the standard error: what the library logs, from a level on."""

from __future__ import annotations

import logging

import click
from rich.markup import escape

from solidsph.commands.console import err

LIBRARY = "solidsph"
"""Name of the logger that all of its modules log to."""

_LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


class _OnTheError(logging.Handler):
    """Prints records in a line each, above a progress bar if there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage()
        if record.levelno == logging.WARNING and not text.startswith("warning"):
            text = f"warning: {text}"
        if record.levelno == logging.DEBUG:
            text = f"{record.name.removeprefix(LIBRARY + '.')}: {text}"
        err.print(escape(text), soft_wrap=True)


def say_from(verbose: int, quiet: bool) -> None:
    """Print what is logged: warnings, with -v also what is done, with -vv every detail.

    Args:
        verbose: how often -v was given.
        quiet: whether only results and errors are shown.

    Raises:
        click.UsageError: both are given.
    """
    if quiet and verbose:
        raise click.UsageError("-q shows less and -v more; give one of them")
    logger = logging.getLogger(LIBRARY)
    level = logging.ERROR if quiet else _LEVELS[min(verbose, len(_LEVELS) - 1)]
    logger.setLevel(level)
    if not any(isinstance(handler, _OnTheError) for handler in logger.handlers):
        logger.addHandler(_OnTheError())
    for handler in logger.handlers:
        if isinstance(handler, _OnTheError):
            handler.setLevel(level)  # others hear more
