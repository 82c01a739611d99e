"""The page of the documentation that holds a run's tables."""

from __future__ import annotations

import datetime
import platform
from collections.abc import Sequence
from pathlib import Path

import numba
import numpy as np
import scipy
from peers import peers
from table import Table


def write_page(path: Path, tables: Sequence[Table]) -> None:
    """Write the tables as Markdown, with what they were measured with."""
    versions = ", ".join(
        [
            f"Python {platform.python_version()}",
            *(f"{m.__name__} {m.__version__}" for m in (np, scipy, numba)),
        ]
    )
    day = datetime.datetime.now(tz=datetime.UTC).date()
    head = (
        "# Benchmarks\n\n"
        "Written by `make bench-page`; nothing here is edited by hand. "
        f"Measured on {day} with {versions}.\n"
        "Machines are shared and noisy: read ratios within a table, which were timed in turns.\n"
    )
    path.write_text("\n".join([head, *(table.markdown() for table in (*tables, peers()))]))
