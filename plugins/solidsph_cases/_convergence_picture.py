"""Errors against spacing, and the arrangements of particles that they belong to."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph.results.record import Record

# Of the arrangements, in their order.
_MARKERS = ("o-", "s--", "^-.", "v:")
_GREYS = ("0.0", "0.3", "0.5", "0.6")


def draw_convergence(
    arrangements: Mapping[str, Record],
    errors: Mapping[str, Array],
    peaks: Mapping[str, Array],
    peak: float,
    spacings: Array,
    *,
    radius: float,
    width: float,
    title: str,
    path: Path,
) -> None:
    """Above the arrangements near the hole at the coarsest spacing; below the errors of the
    displacement, log-log, and the largest stresses beside the reference.

    Args:
        arrangements: a record at the coarsest spacing, by the name of the arrangement.
        errors: of the displacement by arrangement, (k,) [-]; none if there is no reference.
        peaks: largest stresses by arrangement, (k,) [Pa].
        peak: their reference [Pa].
        spacings: over the width, (k,) [-].
    """
    figure = Figure(figsize=(11.0, 8.6 if errors else 4.2), layout="constrained")
    grid = figure.add_gridspec(2 if errors else 1, 6)
    wide = 6 // len(arrangements)
    above = [
        figure.add_subplot(grid[0, wide * k : wide * (k + 1)]) for k in range(len(arrangements))
    ]
    for axes, (name, record) in zip(above, arrangements.items(), strict=True):
        _draw_particles(axes, record, radius, width)
        axes.set_title(f"{name}: {record.particles.count} particles", fontsize=10)
    above[0].set_ylabel("Y / W")
    if errors:
        _draw_errors(figure.add_subplot(grid[1, :3]), errors, spacings)
        _draw_peaks(figure.add_subplot(grid[1, 3:]), peaks, peak, spacings)
    figure.suptitle(title, fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _draw_particles(axes: Axes, record: Record, radius: float, width: float) -> None:
    particles = record.particles
    x, y = particles.positions.T / width
    surface = particles.tags["surface"]
    axes.plot(x[~surface], y[~surface], ".", color="0.5", markersize=5)
    axes.plot(x[surface], y[surface], "k.", markersize=7)
    turn = np.linspace(0.0, 0.5 * np.pi, 100)
    axes.plot(*(radius / width * np.array([np.cos(turn), np.sin(turn)])), "k-", linewidth=0.8)
    shown = min(1.0, 2.5 * radius / width)
    axes.set_xlim(-0.04 * shown, shown)
    axes.set_ylim(-0.04 * shown, shown)
    axes.set_aspect("equal")
    axes.set_xlabel("X / W")


def _draw_errors(axes: Axes, errors: Mapping[str, Array], spacings: Array) -> None:
    for (name, values), marker, grey in zip(errors.items(), _MARKERS, _GREYS, strict=False):
        axes.loglog(
            spacings, 100.0 * values, marker, color=grey, label=name, markerfacecolor="white"
        )
    largest = 100.0 * max(float(values.max()) for values in errors.values())
    least = 100.0 * min(float(values.min()) for values in errors.values())
    # Slopes to compare with, below the errors at the coarsest spacing.
    for order, style in ((1, (0, (1, 3))), (2, (0, (5, 5)))):
        line = 0.35 * largest * (spacings / spacings[0]) ** order
        axes.loglog(spacings, line, color="0.6", linestyle=style, linewidth=1.0, zorder=0)
        axes.annotate(
            f"order {order}",
            (spacings[-1], line[-1]),
            xytext=(-4, 0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=8,
            color="0.35",
        )
    axes.set_ylabel("error of the edge's mean u_x [%]")
    axes.legend(frameon=False, fontsize=9, loc="upper left")
    _spacing_axis(axes, spacings)
    lowest = 0.8 * min(least, float(line[-1]))
    axes.set_ylim(lowest, 2.5 * largest)
    known = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
    shown = known[(known > lowest) & (known < 2.5 * largest)]
    axes.set_yticks(shown, [f"{one:g}" for one in shown])
    axes.set_yticks([], minor=True)


def _draw_peaks(axes: Axes, peaks: Mapping[str, Array], peak: float, spacings: Array) -> None:
    for (name, values), marker, grey in zip(peaks.items(), _MARKERS, _GREYS, strict=False):
        axes.semilogx(
            spacings, 1e-6 * values, marker, color=grey, label=name, markerfacecolor="white"
        )
    axes.axhline(1e-6 * peak, color="0.4", linewidth=3.0, alpha=0.4, zorder=0)
    axes.annotate(
        f"reference: {1e-6 * peak:.2f} MPa",
        (0.02, 1e-6 * peak),
        xycoords=axes.get_yaxis_transform(),
        xytext=(0, 5),
        textcoords="offset points",
        fontsize=9,
    )
    axes.set_ylim(0.8e-6 * peak, 1.2e-6 * peak)
    axes.set_ylabel("largest principal Cauchy stress [MPa]")
    _spacing_axis(axes, spacings)


def _spacing_axis(axes: Axes, spacings: Array) -> None:
    axes.set_xlabel("spacing / W")
    axes.set_xticks(spacings, [f"1/{round(1.0 / s)}" for s in spacings])
    axes.set_xticks([], minor=True)
    axes.set_xlim(0.75 * spacings[-1], 1.1 * spacings[0])
