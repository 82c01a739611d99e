"""Pictures as data: marks on panels, panels on a sheet, drawn when the sheet is saved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, final

import attrs
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Mark: TypeAlias = "Callable[[Axes], Any]"
"""Draws something on axes; returns what a colour bar needs, if it has colours."""


def mark(method: str, *data: Any, **style: Any) -> Mark:
    """A mark by that method of matplotlib's axes."""
    return lambda axes: getattr(axes, method)(*data, **style)


def line(x: ArrayLike, y: ArrayLike, style: str = "k-", **more: Any) -> Mark:
    """A curve or markers, in the words of matplotlib's `plot`."""
    return mark("plot", x, y, style, **more)


def theory(x: ArrayLike, y: ArrayLike, label: str | None = "exact", **more: Any) -> Mark:
    """A broad grey curve behind what is measured."""
    look = {"color": "0.78", "linewidth": 4.0, "zorder": 1, "label": label}
    return mark("plot", x, y, **look | more)


def level(height: float, label: str = "", **style: Any) -> Mark:
    """A line across the panel, with a label at its right end."""
    look: dict[str, Any] = {"color": "black", "linewidth": 0.9} | style

    def draw(axes: Axes) -> None:
        axes.axhline(height, **look)
        axes.annotate(
            label,
            (0.99, height),
            xycoords=axes.get_yaxis_transform(),
            xytext=(0, 3),
            textcoords="offset points",
            ha="right",
            fontsize=9,
        )

    return draw


def zero() -> Mark:
    """A faint line at zero."""
    return level(0.0, color="0.82", linewidth=0.7, zorder=0)


def text(x: float, y: float, words: str, **style: Any) -> Mark:
    """Words at a place of the data."""
    return mark("text", x, y, words, **{"ha": "center", "va": "center", "fontsize": 9} | style)


def note(words: str) -> Mark:
    """Words at the top of the panel."""
    return lambda axes: axes.text(
        0.5, 0.95, words, transform=axes.transAxes, ha="center", va="top", fontsize=9
    )


def arrow(tip: Sequence[float], tail: Sequence[float], style: str = "-|>", **more: Any) -> Mark:
    """An arrow without words."""
    return mark("annotate", "", tip, tail, arrowprops={"arrowstyle": style, **more})


@final
@attrs.frozen(eq=False, init=False)
class Panel:
    """One pair of axes."""

    marks: Sequence[Mark]
    title: str
    legend: Mapping[str, Any] | None  # its style; None for no legend
    grid: bool
    projection: str | None
    same_x: str  # panels of one name have one scale, and labels at the outermost of them
    same_y: str
    properties: Mapping[str, Any]

    def __init__(
        self,
        *marks: Mark,
        x: str = "",
        y: str = "",
        title: str = "",
        legend: Mapping[str, Any] | None = None,
        grid: bool = False,
        projection: str | None = None,
        same_x: str = "",
        same_y: str = "",
        **properties: Any,
    ) -> None:
        """A panel with the labels `x` and `y` of its axes, with units.

        `properties` are those of matplotlib's axes: xlim, ylim, xscale, aspect ...
        """
        named = {"xlabel": x, "ylabel": y, **properties}
        self.__attrs_init__(marks, title, legend, grid, projection, same_x, same_y, named)

    def draw(self, axes: Axes) -> Any:
        """Draw all marks; returns what the last one with colours left for a colour bar."""
        coloured = None
        for one in self.marks:
            made = one(axes)
            coloured = made if hasattr(made, "set_clim") else coloured
        axes.set(**self.properties)
        if self.title:
            axes.set_title(self.title, fontsize=10)
        if self.grid:
            axes.grid(color="0.92")
        if self.legend is not None:
            axes.legend(**{"frameon": False, "fontsize": 9} | dict(self.legend))
        return coloured


@final
@attrs.frozen(eq=False)
class Bar:
    """A colour bar beside some panels, for the colours of the last one."""

    label: str
    panels: Sequence[Panel]
    style: Mapping[str, Any] = attrs.field(factory=dict)


BELOW: Mapping[str, Any] = {"location": "bottom", "shrink": 0.8, "aspect": 40}
"""The style of a colour bar below its panel."""


@final
@attrs.frozen(eq=False)
class Sheet:
    """A picture: panels in rows. One that stands in a row several times is as wide as that."""

    rows: Sequence[Sequence[Panel | None]]
    size: tuple[float, float]  # [inches]
    title: str = ""
    widths: Sequence[float] | None = None  # of the columns, relative
    heights: Sequence[float] | None = None
    bars: Sequence[Bar] = ()
    key: Panel | None = None  # whose legend stands below all
    key_style: Mapping[str, Any] = attrs.field(factory=dict)

    def save(self, path: Path) -> Path:
        """Draw it into a file; returns the path."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=self.size, layout="constrained")
        axes, coloured = self._axes(figure), {}
        for one, where in axes.items():
            coloured[one] = one.draw(where)
        self._hide_inner_labels(axes)
        for bar in self.bars:
            beside = [axes[one] for one in bar.panels]
            figure.colorbar(coloured[bar.panels[-1]], ax=beside, label=bar.label, **bar.style)
        if self.key is not None:
            handles, labels = axes[self.key].get_legend_handles_labels()
            place: dict[str, Any] = {"loc": "outside lower center", "ncols": len(labels)}
            figure.legend(handles, labels, frameon=False, **place | dict(self.key_style))
        if self.title:
            figure.suptitle(self.title, fontsize=11)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=150)
        return path

    def _axes(self, figure: Figure) -> Mapping[Panel, Axes]:
        """Axes by panel, those of one scale tied together."""
        panels = list(dict.fromkeys(one for row in self.rows for one in row if one is not None))
        names: Any = [
            ["." if one is None else str(panels.index(one)) for one in row] for row in self.rows
        ]
        made = figure.subplot_mosaic(
            names,
            width_ratios=self.widths,
            height_ratios=self.heights,
            per_subplot_kw={str(k): {"projection": p.projection} for k, p in enumerate(panels)},
        )
        axes = {one: made[str(k)] for k, one in enumerate(panels)}
        first: dict[tuple[str, str], Axes] = {}
        for one, where in axes.items():
            for name, group, share in (
                ("x", one.same_x, where.sharex),
                ("y", one.same_y, where.sharey),
            ):
                other = first.setdefault((name, group), where)
                if group and other is not where:
                    share(other)
        return axes

    def _hide_inner_labels(self, axes: Mapping[Panel, Axes]) -> None:
        """Leave the labels of a common scale to the lowest and to the leftmost panel."""
        for upper, lower in pairwise(self.rows):
            for one, below in zip(upper, lower, strict=True):
                if one and below and one is not below and one.same_x and one.same_x == below.same_x:
                    axes[one].tick_params(labelbottom=False)
                    axes[one].set_xlabel("")
        for row in self.rows:
            for left, one in pairwise(row):
                if one and left and one is not left and one.same_y and one.same_y == left.same_y:
                    axes[one].tick_params(labelleft=False)
                    axes[one].set_ylabel("")
