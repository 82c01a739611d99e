"""Error bars of a record: numbers taken from its history, with their estimated errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, final

import attrs
import h5py
import numpy as np

from solidsph.results.record_file import explained
from solidsph.results.sole_writer import sole_writer

PLACE = "solidsph/error_bars"

_COLUMNS = ("quantity", "value", "bar", "warning")


@final
@attrs.frozen
class ErrorBar:
    """A number, and how far the truth may be from it, as refinement has estimated."""

    value: float
    bar: float  # in the unit of the value
    warning: str = ""  # why it is not to be relied on; empty if it is

    def __str__(self) -> str:
        return f"{self.value:.6g} +- {self.bar:.2g}"


def write_error_bars(path: Path, bars: Mapping[str, ErrorBar]) -> None:
    """Add error bars, at least one, by quantity, to the closed record of a run.

    Raises:
        RecordError: another run writes the file, or it cannot be written.
    """
    names = [name.encode() for name in bars]
    warnings = [bar.warning.encode() for bar in bars.values()]
    # Texts of fixed length stand in the table itself.
    kinds = (f"S{max(map(len, names))}", "f8", "f8", f"S{max(map(len, warnings)) or 1}")
    rows = [
        (name, bar.value, bar.bar, warning)
        for name, bar, warning in zip(names, bars.values(), warnings, strict=True)
    ]
    table = np.array(rows, dtype=list(zip(_COLUMNS, kinds, strict=True)))
    with (
        sole_writer(path),
        explained(f"cannot write the error bars to {path}", "make room, and run the scene again"),
        h5py.File(path, "r+") as file,
    ):
        file.create_dataset(PLACE, data=table)


def read_error_bars(file: Any) -> Mapping[str, ErrorBar]:
    """Error bars in an open record, by quantity; none if it has none."""
    found = file.get(PLACE)
    if found is None:
        return {}
    if found.dtype.names != _COLUMNS:
        raise ValueError(f"{PLACE} is no table of error bars")
    rows: Sequence[Any] = found[()]
    return {
        row["quantity"].decode(): ErrorBar(
            float(row["value"]), float(row["bar"]), row["warning"].decode()
        )
        for row in rows
    }
