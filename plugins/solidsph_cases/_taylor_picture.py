"""The picture of a Taylor bar: cuts through its axis, and its length and foot over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph.results.record import Record

_SHOWN = (0.0, 0.125, 0.375, 1.0)  # parts of the duration

_STRAIN = "plastic strain"


def draw_bar(
    record: Record,
    lengths: Array,
    radii: Array,
    ranges: tuple[tuple[float, float], tuple[float, float]] | None,
    spacing: float,
    title: str,
    path: Path,
) -> None:
    """Particles near a plane through the axis by plastic strain at four times; the curves (t,) [m],
    with published ranges at the end."""
    figure = Figure(figsize=(12.5, 5.5), layout="constrained")
    grid = figure.add_gridspec(2, len(_SHOWN) + 3)
    times = record.times
    X = record.particles.positions
    cut = np.abs(X[:, 1]) < 0.3 * spacing
    shown = [round(part * (len(times) - 1)) for part in _SHOWN]
    strains = record.field(_STRAIN)
    largest = float(strains[-1].max())
    for column, k in enumerate(shown):
        axes = figure.add_subplot(grid[:, column])
        x = 1e3 * record.positions[k][cut]
        points = axes.scatter(
            x[:, 0], x[:, 2], c=strains[k][cut], cmap="inferno", vmin=0.0, vmax=largest, s=9
        )
        axes.axhline(0.0, color="0.5", linewidth=1.0, zorder=0)
        axes.set_aspect("equal")
        axes.set_xlim(-8.0, 8.0)
        axes.set_ylim(-1.0, 33.5)
        axes.set_title(f"{1e6 * times[k]:.0f} us", fontsize=10)
        axes.set_xlabel("x [mm]")
        if column:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("z [mm]")
    figure.colorbar(points, ax=axes, label="equivalent plastic strain")
    for row, (values, name) in enumerate(((lengths, "length"), (radii, "mean foot radius"))):
        axes = figure.add_subplot(grid[row, len(_SHOWN) :])
        axes.plot(1e6 * times, 1e3 * values, color="black")
        if ranges is not None:
            axes.axhspan(*(1e3 * end for end in ranges[row]), color="tab:blue", alpha=0.3)
            axes.annotate(
                "published at the end",
                (0.02, 1e3 * ranges[row][1 - row]),
                xycoords=("axes fraction", "data"),
                fontsize=8,
                color="tab:blue",
                va="top" if row else "bottom",
            )
        axes.set_ylabel(f"{name} [mm]")
        axes.set_xlabel("time [us]")
    figure.suptitle(f"{title}: {record.particles.count} particles", fontsize=12)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
