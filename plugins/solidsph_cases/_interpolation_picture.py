"""Figs. 3 to 5: a function and its derivatives beside what the particles make of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph_cases._line import LENGTH, Line
from solidsph_cases.interpolation import ORDERS, F, approximated

_SOURCE = "Ismail & Reddy"

# Told apart in grey: by dashes first, then by shade.
_FEW = 30  # particles whose marks do not run together
_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
_MARKERS = ("o", "s", "^", "D", "v", "x")


def draw_cover(axis: Axes, x: Array, values: Array, cover: float, k: int, count: int) -> None:
    """The k-th of so many curves, with a mark at every particle where they are few."""
    axis.plot(
        x,
        values,
        color=f"{0.6 * (1.0 - (k + 1) / count):.3f}",
        linestyle=_STYLES[k % len(_STYLES)],
        marker=_MARKERS[k % len(_MARKERS)] if len(x) <= _FEW else "",
        markersize=4,
        linewidth=1.3,
        label=f"{cover:g} ps",
    )


def draw_ends(lines: Mapping[float, Line], kernel: str, path: Path) -> None:
    """Fig. 3: without extra particles the approximation droops at both ends."""
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    whole, near = figure.subplots(2, len(ORDERS))
    _row(whole, lines)
    # The gradients leave the picture at the ends, where f itself counts as a step.
    whole[1].set_ylim(-1.5, 1.5)
    whole[2].set_ylim(-12.0, 12.0)
    reach = 2.5 * max(line.kernel.support_radius for line in lines.values())
    _row(near, lines, reach)
    near[0].text(0.95, 0.95, "the left end", transform=near[0].transAxes, ha="right", va="top")
    some = next(iter(lines.values()))
    title = f"$(x - 1/2)^4$ without extra particles, spacing {some.spacing:g} m ({kernel})"
    finish(figure, near, "x [m]", f"{title}; {_SOURCE}, Fig. 3", path)


def draw_complete(rows: Sequence[Mapping[float, Line]], kernel: str, path: Path) -> None:
    """Figs. 4 and 5: ghosts continue the function beyond the ends."""
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    axes = figure.subplots(len(rows), len(ORDERS), sharex=True, squeeze=False)
    for row, lines in zip(axes, rows, strict=True):
        _row(row, lines)
        some = next(iter(lines.values()))
        row[0].text(
            0.5,
            0.95,
            f"spacing {some.spacing:g} m",
            transform=row[0].transAxes,
            ha="center",
            va="top",
        )
    title = f"$(x - 1/2)^4$ with ghosts beyond the ends ({kernel})"
    finish(figure, axes[-1], "x [m]", f"{title}; {_SOURCE}, Figs. 4 and 5", path)


def _row(axes: Sequence[Axes], lines: Mapping[float, Line], reach: float = LENGTH) -> None:
    """f and its derivatives from 0 to `reach` [m]."""
    x = np.linspace(0.0, min(reach, LENGTH), 400)
    for axis, (order, name) in zip(axes, ORDERS.items(), strict=True):
        axis.plot(x, F.deriv(order)(x), color="0.8", linewidth=5.0, label="exact")
        for k, (cover, line) in enumerate(lines.items()):
            shown = line.real & (reach >= line.X)
            draw_cover(axis, line.X[shown], approximated(line, order)[shown], cover, k, len(lines))
        power = 4 - order
        axis.set_ylabel(f"$\\langle {name} \\rangle$ [m$^{power}$]")
        axis.grid(color="0.93")


def finish(figure: Figure, bottom: Sequence[Axes], along: str, title: str, path: Path) -> None:
    """One legend for all, below; then written."""
    for axis in bottom:
        axis.set_xlabel(along)
    handles, labels = bottom[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=len(labels),
        frameon=False,
        title="cover, in particle spacings (ps)",
        title_fontsize=9,
        handlelength=3.5,
    )
    figure.suptitle(title, fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
