"""Figs. 10 and 11: the bar with its stations, and the stress histories there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph.results.record import Record
from solidsph_cases._bar import LENGTH
from solidsph_cases._bar_histories import Histories
from solidsph_cases._bar_waves import BarWaves
from solidsph_cases.drawing.sheet import Panel, Sheet, arrow, line, mark, text, theory, zero


@final
@attrs.frozen(eq=False)
class Column:
    """The histories of one run."""

    heading: str
    exact: BarWaves
    record: Record
    viscous: Record | None = None  # the same run with viscosity, if any

    def panels(self, stations: Sequence[float], end: float) -> list[Panel]:
        """One panel for each station, from 0 to `end` [s]."""
        times = np.linspace(0.0, float(self.record.times[-1]), 3000)
        panels: list[Panel] = []
        for station in stations:
            exact = 1e-3 * self.exact.stress(np.array(station), times)
            stress = 1e-3 * Histories.of(self.record, self.exact).at(station)
            marks = [
                theory(1e6 * times, exact, linewidth=3.2),
                line(1e6 * self.record.times, stress, linewidth=0.7, label="SPH"),
                zero(),
            ]
            if self.viscous is not None:
                stress = 1e-3 * Histories.of(self.viscous, self.exact).at(station)
                style = {"color": "tab:red", "linewidth": 1.4, "label": "SPH with viscosity"}
                marks.append(line(1e6 * self.viscous.times, stress, "--", **style))
            panels.append(
                Panel(
                    *marks,
                    title="" if panels else self.heading,
                    x="time [us]",
                    y=f"T11 at {station:g} m\n[kPa]",
                    same_x="time",
                    same_y="stress",
                    xlim=(0.0, 1e6 * end),
                )
            )
        return panels


def histories_sheet(columns: Sequence[Column], stations: Sequence[float], title: str) -> Sheet:
    """The bar; below it one row a station and one column a run, all on one scale."""
    end = max(float(column.record.times[-1]) for column in columns)
    panels = [column.panels(stations, end) for column in columns]
    rows = [[_bar(stations)] * len(columns), *(list(row) for row in zip(*panels, strict=True))]
    count = int((~columns[0].record.particles.ghosts).sum())
    return Sheet(
        rows,
        (max(7.5, 3.25 * len(columns)), 9.6),
        f"{title}: {count} particles (Ismail & Reddy, Figs. 10 and 11)",
        heights=(0.55, *[1.0] * len(stations)),
        key=panels[0][0],
    )


def _bar(stations: Sequence[float]) -> Panel:
    """Fig. 10: the pulse comes from the left, the right end is fixed."""
    wall = {"facecolor": "white", "edgecolor": "black", "hatch": "////"}
    rod = {"color": "0.85", "edgecolor": "black", "linewidth": 1.0}
    names: dict[str, Any] = {"ha": "right", "va": "top"}
    return Panel(
        mark("fill_between", [0.0, LENGTH], -0.25, 0.25, **rod),
        mark("fill_between", [LENGTH, LENGTH + 0.003], -0.6, 0.6, **wall),
        arrow((0.0, 0.0), (-0.012, 0.0), color="black", linewidth=1.5),
        text(-0.0135, 0.0, "pulse, T11 = -100 kPa", ha="right"),
        text(LENGTH + 0.005, 0.0, "fixed", ha="left"),
        line(stations, np.zeros(len(stations)), "ko", markersize=5),
        *(text(station - 0.002, -0.42, f"{station:g} m", **names) for station in stations),
        mark("axis", "off"),
        xlim=(-0.055, LENGTH + 0.03),
        ylim=(-1.0, 0.7),
    )
