"""Records as tables of pandas, datasets of xarray, and an overview for notebooks."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from solidsph.errors import RecordError
from solidsph.model.regions import AXES
from solidsph.results.output_fields import split_unit
from solidsph.results.recorded import DISPLACEMENT, Recorded
from solidsph.system import html

if TYPE_CHECKING:
    import pandas
    import xarray

ALL = slice(None)


def history_table(record: Recorded) -> pandas.DataFrame:
    """The history, one row an output, over the time [s].

    Raises:
        RecordError: pandas is not installed.
    """
    made: Any = _library("pandas").DataFrame(dict(record.history), index=record.times)
    made.index.name = "time [s]"
    table: pandas.DataFrame = made
    return table


def dataset(
    record: Recorded, fields: Sequence[str] | None = None, outputs: slice = ALL
) -> xarray.Dataset:
    """Fields over outputs and particles, and the history over outputs, with units.

    Args:
        record: to be read.
        fields: names of those wanted; all that the record holds if None.
        outputs: those that are wanted.

    Raises:
        RecordError: xarray is not installed, or there is no such field.
    """
    particles, d = record.particles, record.dimension
    names = record.field_names if fields is None else fields
    wanted = {"position": record.positions, **{name: record.field(name) for name in names}}
    data: dict[str, Any] = {}
    for name, series in wanted.items():
        data[name] = (_dims(series.shape[2:]), series[outputs], _named(name, series.unit))
    for column, values in record.history.items():
        quantity, unit = split_unit(column)
        data[_variable(quantity)] = ("time", values[outputs], _named(quantity, unit))
    bodies = np.empty(particles.count, dtype=object)
    for body, place in particles.bodies.items():
        bodies[place] = body
    coordinates: dict[str, Any] = {
        "time": ("time", record.times[outputs], {**_named("time", "s"), "standard_name": "time"}),
        "axis": ("axis", list(AXES[:d])),
        "body": ("particle", bodies.astype(str)),
        "volume": ("particle", particles.volumes, _named("reference volume", f"m{d}")),
    }
    for number, axis in enumerate(AXES[:d]):
        coordinates[axis] = (
            "particle",
            particles.positions[:, number],
            {**_named(f"reference position {axis}", "m"), "axis": axis},
        )
    for tag, mask in particles.tags.items():
        coordinates[_variable(f"tag {tag}")] = ("particle", mask)
    made: xarray.Dataset = _library("xarray").Dataset(
        data,
        coords=coordinates,
        attrs={
            "Conventions": "CF-1.11",
            "title": record.path.stem,
            "source": f"solidsph {record.versions.get('solidsph', '')}".strip(),
            "outcome": record.outcome,
        },
    )
    return made


def overview(record: Recorded) -> str:
    """HTML for notebooks: what the record holds, and its numbers at the end."""
    times = record.times
    known = {
        "outcome": record.outcome,
        "outputs": record.count,
        "t [s]": f"{times[0]:.5g} to {times[-1]:.5g}" if len(times) else "",
        "particles": record.particles.count,
        "fields": ", ".join(dict.fromkeys([DISPLACEMENT, *record.field_names])),
        **({"notes": "; ".join(record.notes)} if record.notes else {}),
    }
    final = {name: float(values[-1]) for name, values in record.history.items() if len(values)}
    bars = {name: str(bar) for name, bar in record.error_bars.items()}
    return (
        html.heading(f"Record {record.path}")
        + html.of_values(known)
        + (html.heading("at the end") + html.of_values(final) if final else "")
        + (html.heading("with error bars") + html.of_values(bars) if bars else "")
    )


def _variable(quantity: str) -> str:
    """A name that can be an attribute of the dataset."""
    return re.sub(r"\W+", "_", quantity).strip("_")


def _dims(components: tuple[int, ...]) -> tuple[str, ...]:
    return ("time", "particle", *("axis", "axis_2")[: len(components)])


def _named(name: str, unit: str) -> dict[str, str]:
    return {"long_name": name.replace("_", " "), "units": "1" if unit == "-" else unit}


def _library(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise RecordError(f"{name} is not installed; run: pip install 'solidsph[tables]'") from None
