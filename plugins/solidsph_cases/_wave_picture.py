"""Figs. 10 and 11: the bar with its stations, and the stress histories there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solidsph.results.record import Record
from solidsph_cases._bar import LENGTH
from solidsph_cases._bar_histories import Histories
from solidsph_cases._bar_waves import BarWaves

Panel = tuple[str, BarWaves, Record, Record | None]
"""Its heading, the exact solution, the run, and the run with viscosity, if any."""


def draw_histories(
    columns: Sequence[Panel], stations: Sequence[float], title: str, path: Path
) -> None:
    """Above the bar; below one row a station and one column a panel, all on one scale."""
    figure = Figure(figsize=(max(7.5, 3.25 * len(columns)), 9.6), layout="constrained")
    rows = len(stations)
    grid = figure.add_gridspec(rows + 1, len(columns), height_ratios=(0.55, *[1.0] * rows))
    _draw_bar(figure.add_subplot(grid[0, :]), stations)
    first: Any = None
    for column, (heading, exact, record, viscous) in enumerate(columns):
        histories = Histories.of(record, exact)
        times = np.linspace(0.0, float(record.times[-1]), 3000)
        for row, station in enumerate(stations):
            axes = figure.add_subplot(grid[row + 1, column], sharex=first, sharey=first)
            first = first or axes
            theory = exact.stress(np.array(station), times)
            axes.plot(1e6 * times, 1e-3 * theory, color="0.72", linewidth=3.2, label="exact")
            axes.plot(
                1e6 * record.times,
                1e-3 * histories.at(station),
                color="black",
                linewidth=0.7,
                label="SPH",
            )
            if viscous is not None:
                axes.plot(
                    1e6 * viscous.times,
                    1e-3 * Histories.of(viscous, exact).at(station),
                    color="tab:red",
                    linewidth=1.4,
                    linestyle="--",
                    label="SPH with viscosity",
                )
            axes.set_xlim(0.0, 1e6 * max(panel[2].times[-1] for panel in columns))
            axes.axhline(0.0, color="0.85", linewidth=0.6, zorder=0)
            axes.tick_params(labelbottom=row == rows - 1, labelleft=column == 0)
            if row == 0:
                axes.set_title(heading, fontsize=9)
            if column == 0:
                axes.set_ylabel(f"T11 at {station:g} m\n[kPa]", fontsize=9)
            if row == rows - 1:
                axes.set_xlabel("time [us]")
            if row == 0 and column == 0:
                handles = axes.get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=3, frameon=False)
    count = int((~columns[0][2].particles.ghosts).sum())
    figure.suptitle(f"{title}: {count} particles (Ismail & Reddy, Figs. 10 and 11)", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _draw_bar(axes: Any, stations: Sequence[float]) -> None:
    """Fig. 10: the pulse comes from the left, the right end is fixed."""
    axes.fill_between([0.0, LENGTH], -0.25, 0.25, color="0.85", edgecolor="black", linewidth=1.0)
    axes.fill_between(
        [LENGTH, LENGTH + 0.003], -0.6, 0.6, facecolor="white", edgecolor="black", hatch="////"
    )
    axes.annotate(
        "",
        xy=(0.0, 0.0),
        xytext=(-0.012, 0.0),
        arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.5},
    )
    axes.text(-0.0135, 0.0, "pulse, T11 = -100 kPa", ha="right", va="center", fontsize=9)
    axes.text(LENGTH + 0.005, 0.0, "fixed", ha="left", va="center", fontsize=9)
    for station in stations:
        axes.plot([station], [0.0], "ko", markersize=5)
        axes.text(station - 0.002, -0.42, f"{station:g} m", ha="right", va="top", fontsize=9)
    axes.set_xlim(-0.055, LENGTH + 0.03)
    axes.set_ylim(-1.0, 0.7)
    axes.axis("off")


def draw_convergence(counts: Sequence[int], errors: Sequence[float], path: Path) -> None:
    """The smooth pulse's error against the spacing, with the slopes to compare with."""
    figure = Figure(figsize=(5.6, 4.4), layout="constrained")
    axes = figure.add_subplot()
    spacing = 1e3 * LENGTH / (np.array(counts) - 1)
    for order, style in ((5.0 / 3.0, "--"), (2.0, ":")):
        axes.loglog(
            spacing,
            errors[-1] * (spacing / spacing[-1]) ** order,
            color="0.5",
            linestyle=style,
            label=f"order {order:.3g}",
        )
    axes.loglog(spacing, errors, "ko-", label="smooth pulse, all particles and times")
    axes.set_xticks(spacing, [f"{one:.3g}" for one in spacing])
    axes.minorticks_off()
    axes.set_xlabel("particle spacing [mm]")
    axes.set_ylabel("root mean square error of T11, relative")
    axes.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
