"""Rows of given points: their coordinates, and what further columns say of each."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from pathlib import Path
from reprlib import repr as short
from typing import Any

import attrs
import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.maths.arrays import Array
from solidsph.system.encoding import decoded, is_number
from solidsph.system.files import content, located
from solidsph_builtin.discretisations._checks import refusal

AXES = ("x", "y", "z")
"""Columns of coordinates."""

SPACING, VOLUME = "spacing", "volume"
"""Columns of the spacing [m] and the volume [m^d] of each point."""

# Size of a file of points: some 25 characters for each coordinate of 5e7 points in space.
_MOST_BYTES = 2**32


@attrs.frozen(eq=False)
class PointTable:
    """Given points in their order, with the spacings and volumes that they come with, if any."""

    positions: Array  # (n, d) [m]
    spacings: Array | None  # (n,) [m]
    volumes: Array | None  # (n,) [m^d]


def check_columns(discretisation: Discretisation, columns: object) -> None:
    """Refuse columns that no point has.

    Raises:
        SceneError: they are not different names among x, y, z, spacing and volume.
    """
    known = (*AXES, SPACING, VOLUME)
    if not isinstance(columns, tuple) or set(columns) - set(known):
        raise refusal(discretisation, f"columns are a list of {', '.join(known)}, got {columns!r}")
    if len(set(columns)) < len(columns):
        raise refusal(discretisation, f"columns names one twice: {', '.join(columns)}")


def point_table(
    discretisation: Discretisation, rows: Any, columns: Sequence[str] | None, dimension: int
) -> PointTable:
    """The points that `rows` (n, k) hold in these `columns`, by default coordinates only.

    Raises:
        SceneError: they do not fit each other or the dimension, or a number is not finite.
    """
    table = np.array(rows, dtype=np.float64, order="C")
    axes = AXES[:dimension]
    if columns is None:
        columns = axes
        if table.ndim == 1 and dimension == 1:
            table = table[:, np.newaxis]
        if table.ndim != 2 or table.shape[1] != dimension or not len(table):
            raise refusal(
                discretisation,
                f"the positions must be rows of {dimension} coordinates, as the shape has "
                f"dimensions, got an array of shape {table.shape}",
            )
    if set(axes) != set(AXES) & set(columns):
        raise refusal(
            discretisation,
            f"columns must name {' and '.join(axes)}, as the shape has dimensions, and no other "
            f"coordinate, got {', '.join(columns)}",
        )
    if table.ndim != 2 or table.shape[1] != len(columns) or not len(table):
        raise refusal(
            discretisation,
            f"the rows must have the {len(columns)} columns {', '.join(columns)}, got an array of "
            f"shape {table.shape}",
        )
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise refusal(
            discretisation, f"row {row} of the positions is not finite: {table[row].tolist()}"
        )
    own = {name: np.ascontiguousarray(table[:, at]) for at, name in enumerate(columns)}
    positions = np.stack([own[axis] for axis in axes], axis=1)
    return PointTable(positions, own.get(SPACING), own.get(VOLUME))


def read_rows(discretisation: Discretisation, path: Path) -> Array:
    """The rows of numbers in a file.

    Raises:
        SceneError: it cannot be read, or holds something else.
    """
    try:
        with warnings.catch_warnings():
            # For a file without any number NumPy only warns.
            warnings.simplefilter("error", UserWarning)
            data, suffix = content(located(path), _MOST_BYTES), path.suffix.lower()
            if suffix == ".npy":
                loaded = np.load(io.BytesIO(data), allow_pickle=False)
                return np.asarray(loaded, dtype=np.float64)
            return _table(decoded(data), "," if suffix == ".csv" else None)
    except (OSError, ValueError, TypeError, EOFError, UserWarning, MemoryError) as error:
        raise refusal(
            discretisation,
            f"cannot read positions from {str(path)!r}: {error}; expected rows of numbers",
        ) from error


def _table(text: str, delimiter: str | None) -> Array:
    """Rows of numbers.

    Raises:
        ValueError: a row holds something else.
    """
    try:
        return np.loadtxt(io.StringIO(text), delimiter=delimiter, ndmin=2)
    except ValueError as cause:
        lines = (line.partition("#")[0].strip() for line in text.splitlines())
        first = next(filter(None, lines), "")
        if any(is_number(word) for word in first.split(delimiter)):
            raise
        hint = f"its first line {short(first)} is not a row of numbers; begin a header with '#'"
        raise ValueError(f"{cause}: {hint}") from None
