"""Fig. 2: particles and ghosts at a boundary, and what the ways to give its value make of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array, Mask
from solidsph_cases import _boundary_ways as ways
from solidsph_cases._line import Line, complete_line
from solidsph_cases.boundary_values import block_condition, largest_error, miss, smoothed
from solidsph_cases.interpolation import F

# The region of Fig. 2: four particles, two of them on the boundary.
_CELLS, _COVER = 3, 2.5

# Told apart in grey: by shade, dashes and mark.
_STYLES: Mapping[str, Mapping[str, Any]] = {
    ways.NO_GHOSTS: {"color": "0.5", "linestyle": ":", "marker": "x"},
    ways.ENDS_SOLVED: {"color": "0.5", "linestyle": "--", "marker": "P"},
    ways.CONSTANT: {"color": "0.5", "linestyle": "-", "marker": "v"},
    ways.CONTINUED: {"color": "0.0", "linestyle": ":", "marker": "D"},
    ways.PRINTED: {"color": "0.0", "linestyle": "-.", "marker": "s"},
    ways.FULL: {"color": "0.0", "linestyle": "--", "marker": "^"},
    ways.SMALLEST: {"color": "0.0", "linestyle": "-", "marker": "o"},
}
_SLOPE_STYLES: Mapping[str, Mapping[str, Any]] = {
    ways.MIRRORED: {"color": "0.5", "linestyle": "--", "marker": "v"},
    ways.SLOPE_SET: {"color": "0.0", "linestyle": "-", "marker": "o"},
}
_SIZES: Mapping[str, Any] = {"markersize": 4.5, "linewidth": 1.2, "markerfacecolor": "white"}
_ROUNDING = 1e-15  # of values of 1e-2; smaller errors are none


def draw_boundary(lines: Mapping[float, Line], kernel: str, path: Path) -> None:
    """Above the region of Fig. 2; below values and slopes at the largest cover, and by covers."""
    figure = Figure(figsize=(14.0, 12.0), layout="constrained")
    grid = figure.add_gridspec(3, 3, height_ratios=(0.75, 1.0, 1.0))
    _draw_region(figure.add_subplot(grid[0, :]), complete_line(kernel, _COVER, _CELLS, supports=1))
    carried, value, error, at_end, beside, slope = (
        figure.add_subplot(grid[row, column]) for row in (1, 2) for column in range(3)
    )
    cover, line = max(lines.items())
    _draw_carried(carried, line)
    _draw_values(value, line)
    _draw_errors(error, line)
    _draw_by_cover(at_end, beside, lines)
    _draw_slopes(slope, line)
    for axis in (carried, value, error, slope):
        axis.axvline(0.0, color="0.85", linewidth=1.0, zorder=0)
        axis.set_xlabel("distance from the boundary [ps]")
    carried.set_title(f"what particles carry, cover {cover:g} ps", fontsize=10)
    value.set_title(f"the approximation, cover {cover:g} ps", fontsize=10)
    error.set_title(f"its error, cover {cover:g} ps", fontsize=10)
    at_end.set_title("at the boundary, by cover", fontsize=10)
    beside.set_title("beside it, by cover, with W's condition", fontsize=10)
    slope.set_title(f"the slope, smoothed again, cover {cover:g} ps", fontsize=10)
    handles, labels = value.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    title = f"Boundary values of $(x - 1/2)^4$, spacing (ps) {line.spacing:g} m ({kernel})"
    figure.suptitle(f"{title}; Ismail & Reddy, section 2.3, Fig. 2", fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _draw_region(axis: Axes, line: Line) -> None:
    """The particles on a line, and the kernel of one on the boundary with its support."""
    x = line.X / line.spacing
    ends = x[ways.ends(line)]
    r = np.linspace(-_COVER, _COVER, 301)
    W = line.spacing * line.kernel.value(np.abs(r) * line.spacing)
    axis.axvspan(*ends, color="0.95", zorder=0)
    for end in ends:
        axis.axvline(end, color="0.7", linewidth=1.0, zorder=0)
    axis.fill_between(ends[0] + r, W, color="0.85", zorder=1)
    axis.plot(ends[0] + r, W, "k-", linewidth=1.2)
    inner = line.real & ~np.isin(x, ends)
    for chosen, mark, filled, label in (
        (~line.real, "o", "white", "ghosts"),
        (np.isin(x, ends), "s", "black", "boundary particles"),
        (inner, "o", "black", "interior particles"),
    ):
        axis.plot(
            x[chosen],
            np.zeros(np.count_nonzero(chosen)),
            linestyle="",
            marker=mark,
            markersize=11,
            color="black",
            markerfacecolor=filled,
            label=label,
            clip_on=False,
            zorder=3,
        )
    top = float(W.max())
    axis.annotate(
        "",
        (ends[0] - _COVER, -0.25 * top),
        (ends[0] + _COVER, -0.25 * top),
        arrowprops={"arrowstyle": "<->"},
    )
    axis.text(ends[0], -0.32 * top, "its support", ha="center", va="top")
    axis.text(ends[0] + 0.5, 0.75 * top, "kernel of a boundary particle", va="center")
    axis.text(ends[1] - 0.08, 0.95 * top, "region", ha="right", va="top", color="0.35")
    axis.set_xlim(x[0] - 0.4, x[-1] + 0.4)
    axis.set_ylim(-0.6 * top, 1.15 * top)
    axis.set_xlabel("distance from the boundary [ps]")
    axis.set_ylabel("W [1/ps]")
    axis.set_yticks([0.0, 0.2, 0.4, 0.6][: 1 + int(top / 0.2)])
    axis.legend(loc="upper right", frameon=False, labelspacing=0.9)


def _draw_carried(axis: Axes, line: Line) -> None:
    x, near = _near_left_end(line, np.ones(len(line.X), dtype=np.bool_))
    f = F(line.X)
    for way, values in ways.carried_values(line).items():
        axis.plot(x[near], (values - f)[near], **_STYLES[way], **_SIZES)
    axis.set_yscale("symlog", linthresh=1e-3)
    axis.set_ylabel("value carried, less f [m$^4$]")
    axis.grid(color="0.93")


def _draw_values(axis: Axes, line: Line) -> None:
    x, near = _near_left_end(line, line.real)
    axis.plot(x[near], F(line.X)[near], color="0.8", linewidth=5.0, label="exact")
    for way, values in ways.carried_values(line).items():
        axis.plot(x[near], smoothed(line, values)[near], **_STYLES[way], **_SIZES, label=way)
    axis.set_ylabel("$\\langle f \\rangle$ [m$^4$]")
    axis.grid(color="0.93")


def _draw_errors(axis: Axes, line: Line) -> None:
    x, near = _near_left_end(line, line.real)
    f = F(line.X)
    for way, values in ways.carried_values(line).items():
        error = np.abs(smoothed(line, values) - f)
        seen = near & (error > _ROUNDING)
        axis.semilogy(x[seen], error[seen], **_STYLES[way], **_SIZES)
    axis.set_ylabel("error of $\\langle f \\rangle$ [m$^4$]")
    axis.grid(color="0.93")


def _draw_by_cover(at_end: Axes, beside: Axes, lines: Mapping[float, Line]) -> None:
    covers = list(lines)
    found: dict[str, list[tuple[float, float]]] = {}
    for line in lines.values():
        for way, values in ways.carried_values(line).items():
            approximation = smoothed(line, values)
            pair = miss(line, approximation), largest_error(line, approximation)
            found.setdefault(way, []).append(pair)
    for way, pairs in found.items():
        misses, errors = np.transpose(pairs)
        at_end.plot(covers, misses, **_STYLES[way], **_SIZES)
        beside.semilogy(covers, errors, **_STYLES[way], **_SIZES)
    at_end.set_yscale("symlog", linthresh=1e-4)
    at_end.set_ylabel("miss of $\\langle f \\rangle$ at the boundary [m$^4$]")
    beside.set_ylabel("largest error of $\\langle f \\rangle$ beside it [m$^4$]")
    low, high = beside.get_ylim()
    beside.set_ylim(low, high * 4.0)
    for cover, line in lines.items():
        beside.annotate(
            np.format_float_positional(
                block_condition(line), precision=3, fractional=False, trim="-"
            ),
            (cover, 0.97),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="top",
            fontsize=9,
        )
    for axis in (at_end, beside):
        axis.set_xlabel("cover [ps]")
        axis.set_xticks(covers)
        axis.margins(x=0.1)
        axis.grid(color="0.93")


def _draw_slopes(axis: Axes, line: Line) -> None:
    x, near = _near_left_end(line, line.real)
    axis.plot(x[near], F.deriv()(line.X)[near], color="0.8", linewidth=5.0, label="exact")
    for way, carried in ways.carried_slopes(line).items():
        axis.plot(
            x[near],
            smoothed(line, carried)[near],
            **_SLOPE_STYLES[way],
            **_SIZES,
            label=way,
        )
    axis.set_ylabel("$\\langle \\langle f' \\rangle \\rangle$ [m$^3$]")
    axis.legend(loc="lower right", frameon=False, fontsize=9)
    axis.grid(color="0.93")


def _near_left_end(line: Line, kinds: Mask) -> tuple[Array, Mask]:
    """Places in spacings (n,), and which of these kinds are near the left end."""
    reach = 1.5 * line.kernel.support_radius
    return line.X / line.spacing, kinds & (reach >= line.X)
