"""Fig. 2: particles and ghosts at a boundary, and the ways to give its value side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solidsph.maths.arrays import Mask
from solidsph_cases import _boundary_ways as ways
from solidsph_cases._line import F, Line, complete_line
from solidsph_cases.drawing.sheet import (
    Mark,
    Panel,
    Sheet,
    arrow,
    line,
    mark,
    text,
    theory,
)

# The region of Fig. 2: four particles, two of them on the boundary.
_CELLS, _COVER = 3, 2.5

# Grey, line and marker, distinct without colours.
_STYLES: Mapping[str, tuple[str, str, str]] = {
    ways.NO_GHOSTS: ("0.5", ":", "x"),
    ways.ENDS_SOLVED: ("0.5", "--", "P"),
    ways.CONSTANT: ("0.5", "-", "v"),
    ways.CONTINUED: ("0.0", ":", "D"),
    ways.PRINTED: ("0.0", "-.", "s"),
    ways.FULL: ("0.0", "--", "^"),
    ways.SMALLEST: ("0.0", "-", "o"),
    ways.MIRRORED: ("0.5", "--", "v"),
    ways.SLOPE_SET: ("0.0", "-", "o"),
}
_ROUNDING = 1e-15  # of values of 1e-2; smaller errors are none


def boundary_sheet(lines: Mapping[float, Line], kernel: str) -> Sheet:
    """The region of Fig. 2; below it values and slopes at the largest cover, and by cover."""
    cover, of = max(lines.items())
    at = f"cover {cover:g} ps"
    f, slope, values, slopes = (
        *(F(of.X), F.deriv()(of.X), ways.carried_values(of), ways.carried_slopes(of)),
    )
    real = _near_left_end(of, of.real)
    every = _near_left_end(of, np.ones(len(of.X), dtype=np.bool_))
    approximations = {way: ways.smoothed(of, carried) for way, carried in values.items()}
    errors = {way: np.abs(found - f) for way, found in approximations.items()}
    x = of.X / of.spacing
    carried = _along(
        *(_way(way, x[every], (carried - f)[every]) for way, carried in values.items()),
        mark("set_yscale", "symlog", linthresh=1e-3),
        title=f"what particles carry, {at}",
        y="value carried, less f [m$^4$]",
    )
    value = _along(
        theory(x[real], f[real]),
        *(_way(way, x[real], found[real]) for way, found in approximations.items()),
        title=f"the approximation, {at}",
        y="$\\langle f \\rangle$ [m$^4$]",
    )
    seen = {way: real & (error > _ROUNDING) for way, error in errors.items()}
    error = _along(
        *(_way(way, x[seen[way]], error[seen[way]]) for way, error in errors.items()),
        title=f"its error, {at}",
        y="error of $\\langle f \\rangle$ [m$^4$]",
        yscale="log",
    )
    set_slope = _along(
        theory(x[real], slope[real]),
        *(_way(way, x[real], ways.smoothed(of, one)[real]) for way, one in slopes.items()),
        title=f"the slope, smoothed again, {at}",
        y="$\\langle \\langle f' \\rangle \\rangle$ [m$^3$]",
        legend={"loc": "lower right"},
    )
    region = _region(complete_line(kernel, _COVER, _CELLS, supports=1))
    title = f"Boundary values of $(x - 1/2)^4$, spacing (ps) {of.spacing:g} m ({kernel})"
    return Sheet(
        [[region] * 3, [carried, value, error], [*_by_cover(lines), set_slope]],
        (14.0, 12.0),
        f"{title}; Ismail & Reddy, section 2.3, Fig. 2",
        heights=(0.75, 1.0, 1.0),
        key=value,
        key_style={"ncols": 4},
    )


def _way(way: str, x: ArrayLike, values: ArrayLike) -> Mark:
    color, style, marker = _STYLES[way]
    look: dict[str, Any] = {"color": color, "linestyle": style, "marker": marker, "label": way}
    return mark("plot", x, values, ms=4.5, linewidth=1.2, markerfacecolor="white", **look)


def _along(*marks: Mark, **options: Any) -> Panel:
    """A panel over the distance from the boundary."""
    boundary = mark("axvline", 0.0, color="0.85", linewidth=1.0, zorder=0)
    return Panel(*marks, boundary, x="distance from the boundary [ps]", grid=True, **options)


def _region(of: Line) -> Panel:
    """The particles on a line, and the kernel of one on the boundary with its support."""
    x = of.X / of.spacing
    left, right = ends = x[ways.ends(of)]
    r = np.linspace(-_COVER, _COVER, 301)
    W = of.spacing * of.kernel.value(np.abs(r) * of.spacing)
    top = float(W.max())
    at_ends = np.isin(x, ends)
    particles = [
        line(
            *(x[chosen], np.zeros(np.count_nonzero(chosen)), style),
            markersize=11,
            markerfacecolor=filled,
            label=label,
            clip_on=False,
            zorder=3,
        )
        for chosen, style, filled, label in (
            (~of.real, "ko", "white", "ghosts"),
            (at_ends, "ks", "black", "boundary particles"),
            (of.real & ~at_ends, "ko", "black", "interior particles"),
        )
    ]
    return Panel(
        mark("axvspan", left, right, color="0.95", zorder=0),
        *(mark("axvline", end, color="0.7", linewidth=1.0, zorder=0) for end in ends),
        mark("fill_between", left + r, W, color="0.85", zorder=1),
        line(left + r, W, linewidth=1.2),
        *particles,
        arrow((left - _COVER, -0.25 * top), (left + _COVER, -0.25 * top), "<->"),
        text(left, -0.32 * top, "its support", va="top", fontsize=10),
        text(left + 0.5, 0.75 * top, "kernel of a boundary particle", ha="left", fontsize=10),
        text(right - 0.08, 0.95 * top, "region", ha="right", va="top", color="0.35", fontsize=10),
        x="distance from the boundary [ps]",
        y="W [1/ps]",
        xlim=(x[0] - 0.4, x[-1] + 0.4),
        ylim=(-0.6 * top, 1.15 * top),
        yticks=[0.0, 0.2, 0.4, 0.6][: 1 + int(top / 0.2)],
        legend={"loc": "upper right", "labelspacing": 0.9, "fontsize": 10},
    )


def _by_cover(lines: Mapping[float, Line]) -> Sequence[Panel]:
    """The miss at the boundary and the largest error beside it, with the condition of W."""
    covers = list(lines)
    misses: dict[str, list[float]] = {}
    errors: dict[str, list[float]] = {}
    for of in lines.values():
        for way, values in ways.carried_values(of).items():
            approximation = ways.smoothed(of, values)
            misses.setdefault(way, []).append(ways.miss(of, approximation))
            errors.setdefault(way, []).append(ways.largest_error(of, approximation))
    shared: dict[str, Any] = {"x": "cover [ps]", "xticks": covers, "grid": True}
    margins = mark("margins", x=0.1)
    conditions = [
        mark(
            "annotate",
            np.format_float_positional(
                ways.block_condition(of), precision=3, fractional=False, trim="-"
            ),
            (cover, 0.97),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="top",
            fontsize=9,
        )
        for cover, of in lines.items()
    ]
    at_end = Panel(
        *(_way(way, covers, values) for way, values in misses.items()),
        mark("set_yscale", "symlog", linthresh=1e-4),
        margins,
        title="at the boundary, by cover",
        y="miss of $\\langle f \\rangle$ at the boundary [m$^4$]",
        **shared,
    )
    beside = Panel(
        mark("set_yscale", "log"),
        *(_way(way, covers, values) for way, values in errors.items()),
        margins,
        *conditions,
        title="beside it, by cover, with W's condition",
        y="largest error of $\\langle f \\rangle$ beside it [m$^4$]",
        ylim=(None, 5.0 * max(map(max, errors.values()))),  # room for the conditions
        **shared,
    )
    return at_end, beside


def _near_left_end(of: Line, kinds: Mask) -> Mask:
    """Which particles of these kinds are near the left end (n,)."""
    return np.asarray(kinds & (1.5 * of.kernel.support_radius >= of.X))
