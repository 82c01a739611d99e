"""Figs. 6 to 9: falling edges and their slopes beside what the particles make of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solidsph.maths.arrays import Array
from solidsph_cases._interpolation_picture import draw_cover, finish
from solidsph_cases._line import LENGTH, Line
from solidsph_cases.falling_edge import edge, true_slope


def draw_edges(
    lines: Mapping[str, Mapping[float, Line]],
    figures: Mapping[str, int],
    kernel: str,
    path: Path,
) -> None:
    """A column a figure, by the width of its edge: the field, its plain and corrected slope."""
    figure = Figure(figsize=(12.0, 10.0), layout="constrained")
    axes = figure.subplots(3, len(figures), sharex="col", squeeze=False)
    for column, (name, width) in zip(axes.T, figures.items(), strict=True):
        column[0].set_title(
            f"{name}: edge over {width} spacing{'s' if width > 1 else ''}", fontsize=10
        )
        plain, corrected = lines["standard"], lines["corrected"]
        _draw(column[0], width, plain, edge, lambda line, f: line.smoothing @ f)
        for axis, by_cover in ((column[1], plain), (column[2], corrected)):
            _draw(axis, width, by_cover, _slope, lambda line, f: line.spacing * (line.gradient @ f))
    axes[0, 0].set_ylabel("$\\langle f \\rangle$ [1]")
    axes[1, 0].set_ylabel("$\\langle f' \\rangle$, plain gradient [1/ps]")
    axes[2, 0].set_ylabel("$\\langle f' \\rangle$, corrected gradient [1/ps]")
    title = f"Falling edges ({kernel}); Ismail & Reddy, {' and '.join(figures)}"
    finish(figure, axes[-1], "distance from the middle [ps]", title, path)


def _slope(line: Line, width: int) -> Array:
    return line.spacing * true_slope(line, width)


def _draw(
    axis: Axes,
    width: int,
    lines: Mapping[float, Line],
    exact: Callable[[Line, int], Array],
    approximation: Callable[[Line, Array], Array],
) -> None:
    """Near the edge: what is exact at the particles, and what they make of it."""
    for k, (cover, line) in enumerate(lines.items()):
        places = (line.X - 0.5 * LENGTH) / line.spacing
        # As far as the largest support reaches beyond the kinks.
        near = (np.abs(places) <= 0.5 * width + max(lines) + 1.0) & line.real
        if k == 0:
            values = exact(line, width)[near]
            axis.plot(places[near], values, color="0.8", linewidth=5.0, label="exact")
        found = approximation(line, edge(line, width))[near]
        draw_cover(axis, places[near], found, cover, k, len(lines))
    axis.grid(color="0.93")
