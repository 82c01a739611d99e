"""What a build is doing: told as it begins to whoever listens to a logger."""

from __future__ import annotations

import logging

BUILD = logging.getLogger("solidsph.build")
"""Logger of builds: each stage at INFO as it begins, how far it is at DEBUG.

The verbs show the last of both on the terminal; a program hears them where it listens to the logger
`solidsph`."""

_LAST = "is_last"


def tell_built(text: str, *values: object) -> None:
    """Tell that a build has ended, with a `text` and its `values` as for `Logger.info`."""
    BUILD.info(text, *values, extra={_LAST: True})


def is_last(record: logging.LogRecord) -> bool:
    """Whether a record is the last one of a build."""
    return bool(getattr(record, _LAST, False))
