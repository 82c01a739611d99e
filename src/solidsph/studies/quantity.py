"""Quantity: one number of a run, taken from a column of its history."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.results.output_fields import history, of_probe, split_unit
from solidsph.results.record import Record
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.scene import Scene


def _final(times: Array, values: Array) -> float:
    return float(values[-1])


def _peak(times: Array, values: Array) -> float:
    """Value of the largest magnitude, by a parabola through it and its neighbours in time."""
    place = int(np.nanargmax(np.abs(values)))
    if not 0 < place < len(values) - 1:
        return float(values[place])
    around = slice(place - 1, place + 2)
    a, b, c = np.polyfit(times[around] - times[place], values[around], 2)
    if a == 0.0:
        return float(values[place])
    top = -b / (2.0 * a)  # the parabola is of use only between its points
    inside = times[place - 1] < times[place] + top < times[place + 1]
    return float(c - b * b / (4.0 * a)) if inside else float(values[place])


def _mean(times: Array, values: Array) -> float:
    length = times[-1] - times[0]
    return float(np.trapezoid(values, times) / length) if length > 0.0 else float(values[-1])


REDUCTIONS: Mapping[str, Callable[[Array, Array], float]] = {
    "final": _final,
    "peak": _peak,
    "mean": _mean,
}
"""What makes a number of a column: the last value, the one of the largest magnitude with its sign,
the mean over time."""


@final
@attrs.frozen
class Quantity:
    """A column of the history, and what makes a number of it."""

    column: str  # with its unit
    reduction: str  # one of REDUCTIONS
    beside: Sequence[str] = ()  # columns of the same probe with the same unit, itself included

    @property
    def name(self) -> str:
        """Name in tables, with the unit."""
        return f"{self.reduction} {self.column}"

    @property
    def unit(self) -> str:
        """Unit of the value."""
        return split_unit(self.column)[1]

    def value(self, record: Record) -> float:
        """The number, from a record.

        Raises:
            SceneError: the record has no such column.
        """
        return REDUCTIONS[self.reduction](record.times, self.series(record))

    def series(self, record: Record) -> Array:
        """The whole column (steps,) of a record.

        Raises:
            SceneError: the record has no such column.
        """
        return _column(record, self.column)

    def scale(self, record: Record) -> float:
        """Largest magnitude of what the probe measured, over time: what errors are relative to.

        So a component that vanishes by symmetry is judged by its vector.
        """
        columns = [_column(record, name) for name in self.beside or (self.column,)]
        return max(float(np.nanmax(np.abs(values))) for values in columns)


def _column(record: Record, name: str) -> Array:
    if name not in record.history:
        raise SceneError(f"{record.path} has no column {name!r}")
    return record.history[name]


def columns_of(simulation: BuiltScene) -> Sequence[str]:
    """Columns that the history of a simulation has, with their units."""
    terms = (*simulation.terms, *simulation.probes)
    return list(history(simulation.observe(simulation.start()), 0.0, terms))


def quantities(scene: Scene, columns: Sequence[str], wanted: Sequence[str] = ()) -> list[Quantity]:
    """The quantities of a scene that someone asks for.

    Args:
        scene: whose probes are asked for if nothing else is.
        columns: of its history.
        wanted: each a column, with or without its unit, or the label of a probe; before it may
            stand one of REDUCTIONS. Without one it is the last value of an equilibrium, and of a
            motion the last value and the peak.

    Raises:
        SceneError: nothing is asked for, or there is no such column.
    """
    labels = [probe.label or "" for probe in scene.probes]
    usual = ("final",) if scene.statics is not None else ("final", "peak")
    if not wanted:
        wanted = [label for label in labels if list(of_probe(label, columns))]
        if not wanted:
            raise SceneError(
                "the scene has no [[probe]], so nothing to be accurate about; add one, or name a "
                f"column of its history by --of: {', '.join(columns)}"
            )
    found = []
    for text in wanted:
        names, reductions = _chosen(text, labels, columns, usual)
        found += [
            Quantity(name, reduction, tuple(_beside(name, labels, columns)))
            for name in names
            for reduction in reductions
        ]
    return list(dict.fromkeys(found))


def one_quantity(scene: Scene, columns: Sequence[str], name: str) -> Quantity:
    """The quantity that a reference is of: the last value unless it says another.

    Raises:
        SceneError: there is no such column, or several.
    """
    found = quantities(scene, columns, [name])
    names = {quantity.column for quantity in found}
    if len(names) > 1:
        raise SceneError(
            f"a reference of {name!r} may be that of several columns: {', '.join(sorted(names))}; "
            "name one"
        )
    return found[0]


def _chosen(
    text: str, labels: Sequence[str], columns: Sequence[str], usual: Sequence[str]
) -> tuple[Sequence[str], Sequence[str]]:
    """Columns and reductions that a text asks for."""
    first, _, rest = text.partition(" ")
    choices = [(text, usual)]
    if first in REDUCTIONS:
        choices.append((rest, (first,)))
    for name, reductions in choices:
        exact = [column for column in columns if name in (column, split_unit(column)[0])]
        names = exact or (list(of_probe(name, columns)) if name in labels else [])
        if names:
            return names, reductions
    known = [split_unit(column)[0] for column in columns]
    near = get_close_matches(choices[-1][0], [*known, *labels], 1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(known)}"
    raise SceneError(f"the history has no column {text!r}; {hint}")


def _beside(column: str, labels: Sequence[str], columns: Sequence[str]) -> Iterator[str]:
    """Columns of the probe of `column` that have its unit; itself if it is of none."""
    unit = split_unit(column)[1]
    for label in labels:
        mine = list(of_probe(label, columns))
        if column in mine:
            yield from (name for name in mine if split_unit(name)[1] == unit)
            return
    yield column
