"""Records as tables of pandas and datasets of xarray."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from solidsph.errors import RecordError
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.model.regions import AXES
from solidsph.results.output_fields import split_unit
from solidsph.results.time_series import TimeSeries

if TYPE_CHECKING:
    import pandas
    import xarray


def history_table(times: Array, history: Mapping[str, Array]) -> pandas.DataFrame:
    """The history, one row an output, over the time [s].

    Raises:
        RecordError: pandas is not installed.
    """
    made: Any = _library("pandas").DataFrame(dict(history), index=times)
    made.index.name = "time [s]"
    table: pandas.DataFrame = made
    return table


def dataset(
    particles: Particles,
    times: Array,
    fields: Mapping[str, TimeSeries],
    history: Mapping[str, Array],
    outputs: slice,
    about: Mapping[str, str],
) -> xarray.Dataset:
    """Fields over outputs and particles, and the history over outputs, with units.

    Args:
        particles: reference data.
        times: of all outputs (steps,) [s].
        fields: by name.
        history: column -> (steps,) values.
        outputs: those that are wanted.
        about: attributes of the whole.

    Raises:
        RecordError: xarray is not installed.
    """
    d = particles.dimension
    data: dict[str, Any] = {}
    for name, series in fields.items():
        data[name] = (_dims(series.shape[2:]), series[outputs], _named(name, series.unit))
    for column, values in history.items():
        quantity, unit = split_unit(column)
        data[_variable(quantity)] = ("time", values[outputs], _named(quantity, unit))
    bodies = np.empty(particles.count, dtype=object)
    for body, place in particles.bodies.items():
        bodies[place] = body
    coordinates: dict[str, Any] = {
        "time": ("time", times[outputs], {**_named("time", "s"), "standard_name": "time"}),
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
        data, coords=coordinates, attrs={"Conventions": "CF-1.11", **about}
    )
    return made


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
