"""Picture of what the probes of a record measured, with error bars where they are known."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solidsph.errors import RecordError
from solidsph.results.output_fields import of_probe
from solidsph.results.recorded import Recorded
from solidsph.results.shown_figure import ShownFigure

_STYLES = ("-", "--", "-.", ":")


def draw_probes(record: Recorded) -> Figure:
    """Columns of all probes over time, one panel a unit; RecordError if the record has none."""
    columns = probe_columns(record)
    if not columns:
        raise RecordError("the scene of this record has no probe; add [[probe]], and run it again")
    figure = ShownFigure(figsize=(9.0, 1.0 + 3.2 * len(columns)), layout="constrained")
    panels = figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (unit, names) in zip(panels, columns.items(), strict=True):
        for number, name in enumerate(names):
            (line,) = axis.plot(
                record.times,
                record.history[name],
                linestyle=_STYLES[number % len(_STYLES)],
                color=str(0.7 * number / max(1, len(names))),
                label=name.rpartition(" [")[0],
            )
            _draw_bars(axis, record, name, str(line.get_color()))
        axis.set_ylabel(f"[{unit}]")
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    panels[-1].set_xlabel("time [s]")
    return figure


def probe_columns(record: Recorded) -> Mapping[str, Sequence[str]]:
    """Columns of the probes of a record by unit, but for the places of extremes."""
    try:
        probes = tomllib.loads(record.scene).get("probe", [])
    except tomllib.TOMLDecodeError:  # a scene composed in Python
        probes = []
    columns: dict[str, list[str]] = {}
    found = [name for probe in probes for name in of_probe(probe["label"], record.history_units)]
    for name in dict.fromkeys(found):  # a label may begin with another
        columns.setdefault(record.history_units[name], []).append(name)
    return columns


def _draw_bars(axis: Axes, record: Recorded, column: str, colour: str) -> None:
    """Error bars of the final value and of the peak."""
    for place, reduction in ((-1, "final"), (_peak(record, column), "peak")):
        bar = record.error_bars.get(f"{reduction} {column}")
        if bar is not None:
            axis.errorbar(
                record.times[place], bar.value, bar.bar, color=colour, capsize=4, fmt="o", ms=3
            )


def _peak(record: Recorded, column: str) -> int:
    values = np.abs(record.history[column])
    return 0 if np.isnan(values).all() else int(np.nanargmax(values))
