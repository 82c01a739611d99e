"""Errors against spacing, log-log, with the slopes of some orders to compare with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from solidsph.maths.arrays import Array
from solidsph_cases.drawing.sheet import Mark, Panel, mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# One for each curve, distinct in grey.
_STYLES = (("o-", "0.0"), ("s--", "0.3"), ("^-.", "0.5"), ("v:", "0.6"))

# Labels of a logarithmic axis.
_TICKS = np.outer(10.0 ** np.arange(-5.0, 3.0), [1.0, 2.0, 5.0]).ravel()


def by_spacing(spacings: Array, curves: Mapping[str, Array], ticks: Sequence[str]) -> list[Mark]:
    """Curves (k,) by name over spacings (k,), on a logarithmic axis with those ticks."""

    def axis(axes: Axes) -> None:
        axes.set_xscale("log")
        axes.set_xticks(spacings, ticks)
        axes.set_xticks([], minor=True)
        axes.set_xlim(0.75 * spacings.min(), 1.1 * spacings.max())

    marks = [
        mark("plot", spacings, values, style, color=grey, label=name, markerfacecolor="white")
        for (name, values), (style, grey) in zip(curves.items(), _STYLES, strict=False)
    ]
    return [*marks, axis]


def errors_panel(
    spacings: Array,
    errors: Mapping[str, Array],
    orders: Sequence[float],
    ticks: Sequence[str],
    x: str,
    y: str,
) -> Panel:
    """Errors (k,) by name over spacings (k,), the coarsest first, and slopes below them."""
    largest = max(float(values.max()) for values in errors.values())
    slopes = {order: 0.35 * largest * (spacings / spacings[0]) ** order for order in orders}
    everything = [*errors.values(), *slopes.values()]
    lowest = 0.8 * min(float(values.min()) for values in everything)

    def draw_slopes(axes: Axes) -> None:
        axes.set_yscale("log")
        for (order, values), style in zip(slopes.items(), (":", "--"), strict=True):
            axes.plot(spacings, values, style, color="0.6", linewidth=1.0, zorder=0)
            end = (spacings[-1] * 0.98, values[-1])
            axes.text(*end, f"order {order:.3g}", ha="right", va="center", fontsize=8, color="0.35")
        axes.set_ylim(lowest, 2.5 * largest)
        shown = _TICKS[(lowest < _TICKS) & (2.5 * largest > _TICKS)]
        axes.set_yticks(shown, [f"{tick:g}" for tick in shown])
        axes.set_yticks([], minor=True)

    marks = by_spacing(spacings, errors, ticks)
    return Panel(*marks, draw_slopes, x=x, y=y, legend={"loc": "upper left"})
