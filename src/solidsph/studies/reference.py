"""Reference: what a quantity of a scene should be, by a closed form or by measurement."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array, Mask
from solidsph.maths.formulas import Expression, names_in
from solidsph.results.record import Record
from solidsph.studies.case import Measurement
from solidsph.studies.quantity import Quantity
from solidsph.system.encoding import decoded
from solidsph.system.files import content, located

_MOST_BYTES = 2**26  # of a file of measurements

_TIME = "t"


@final
@attrs.frozen
class Curve:
    """Values over time, between which a straight line is drawn."""

    times: tuple[float, ...]  # [s], rising
    values: tuple[float, ...]

    def at(self, times: Array) -> tuple[Mask, Array]:
        """Those of these times that the curve covers, as a mask, and its values there."""
        covered = (times >= self.times[0]) & (times <= self.times[-1])
        return covered, np.interp(times[covered], self.times, self.values)


@final
@attrs.frozen
class Reference:
    """The value of a quantity, or its curve over time."""

    quantity: Quantity
    text: str  # a formula: a number, or a curve if it contains the time t [s]
    curve: Curve | None = None  # from a file, in place of the formula
    source: str = ""
    tolerance: float = 0.01  # largest error with which a run passes [-]

    @classmethod
    def of(
        cls,
        quantity: Quantity,
        given: str | float,
        *,
        folder: Path | None = None,
        source: str = "",
        tolerance: float = 0.01,
    ) -> Reference:
        """From a number, a formula, or the name of a file with columns of times and values.

        Args:
            quantity: what it is of. Its reduction plays no part for a curve.
            given: the number, formula or name.
            folder: where the name of a file begins; the working folder if None.
            source: where it comes from, for tables; the text if empty.
            tolerance: largest error with which a run passes [-].

        Raises:
            SceneError: it is none of these, or the file has no such columns.
        """
        if isinstance(given, str) and Path(given).suffix.lower() in (".csv", ".txt", ".dat"):
            path = located(given) if folder is None else folder / given
            return cls(quantity, "", _read(path), source or given, tolerance)
        text = str(given)
        value = Expression.parse(text, [_TIME])({_TIME: 0.0})
        if not _is_curve(text) and not isfinite(float(value)):
            raise SceneError(f"the reference {text!r} is {float(value)}; give a finite number")
        return cls(quantity, text, None, source or text, tolerance)

    def measurement(self, record: Record) -> Measurement:
        """The quantity of a record beside this reference.

        The error of a number is relative to the reference, and where that is zero, to the scale of
        the quantity. The error of a curve is the root of the mean square of its deviation over the
        times that both cover, relative to the largest magnitude of the reference.

        Raises:
            SceneError: the record has no such column, or covers other times.
        """
        if self.curve is None and not _is_curve(self.text):
            reference = float(Expression.parse(self.text, [_TIME])({_TIME: 0.0}))
            value, scale = self.quantity.value(record), self.quantity.scale(record)
            error = abs(value - reference) / (abs(reference) or scale or 1.0)
            return self._measurement(self.quantity.name, value, reference, error)
        times = record.times
        found = self.quantity.series(record)
        covered, wanted = self._curve(times)
        if not covered.any():
            raise SceneError(
                f"the reference of {self.quantity.column!r} covers none of the outputs, which are "
                f"from t = {times[0]:g} to {times[-1]:g} s"
            )
        largest = float(np.abs(wanted).max())
        if largest == 0.0:
            raise SceneError(f"the reference of {self.quantity.column!r} is zero at all outputs")
        error = float(np.sqrt(np.mean((found[covered] - wanted) ** 2))) / largest
        name = f"curve of {self.quantity.column}"
        return attrs.evolve(self._measurement(name, error, None, error), unit="-")

    def _curve(self, times: Array) -> tuple[Mask, Array]:
        if self.curve is not None:
            return self.curve.at(times)
        values = Expression.parse(self.text, [_TIME])({_TIME: times})
        return np.ones(len(times), dtype=np.bool_), np.broadcast_to(values, times.shape)

    def _measurement(
        self, name: str, value: float, reference: float | None, error: float
    ) -> Measurement:
        return Measurement(
            quantity=name,
            value=value,
            unit=self.quantity.unit,
            reference=reference,
            source=self.source,
            error=error,
            passed=error <= self.tolerance,
        )


def _is_curve(text: str) -> bool:
    return _TIME in names_in(text)


def _read(path: Path) -> Curve:
    """Two columns of numbers, times and values; lines of words are headings."""
    try:
        text = decoded(content(path, _MOST_BYTES))
    except (OSError, ValueError) as cause:
        raise SceneError(f"the reference {str(path)!r} cannot be read: {cause}") from None
    rows = [row for row in map(_numbers, _rows(text)) if row is not None]
    times, values = [row[0] for row in rows], [row[1] for row in rows]
    if len(rows) < 2 or any(late <= early for early, late in pairwise(times)):
        raise SceneError(
            f"the reference {str(path)!r} must hold two columns, rising times in seconds and "
            f"values, in at least two rows; {len(rows)} rows of numbers were found"
        )
    return Curve(tuple(times), tuple(values))


def _rows(text: str) -> Sequence[Sequence[str]]:
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    for mark in ";,":
        if any(mark in line for line in lines):
            return list(csv.reader(lines, delimiter=mark))
    return [line.split() for line in lines]


def _numbers(row: Sequence[str]) -> tuple[float, float] | None:
    """The first two entries as finite numbers; None for headings."""
    try:
        time, value = float(row[0]), float(row[1])
    except (ValueError, IndexError):
        return None
    return (time, value) if isfinite(time) and isfinite(value) else None
