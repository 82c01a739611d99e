"""Picture of a frontier: error against time, and against spacing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from solidsph.studies.frontier import Frontier
from solidsph.studies.point import Point, format_setting

_MARKERS = "osD^vP*X<>"


def draw_frontier(frontier: Frontier, title: str, path: Path) -> None:
    """Draw trusted errors against time, and the refinement of every scheme.

    The front is black and dominated points are grey; bars go from the quickest repeat to the
    slowest.
    """
    figure = Figure(figsize=(13.0, 6.0), layout="constrained")
    by_time, by_spacing = figure.subplots(1, 2, sharey=True)
    front = frontier.front()
    schemes = list(dict.fromkeys(frontier.scheme(point) for point in front))
    markers = {scheme: _MARKERS[i % len(_MARKERS)] for i, scheme in enumerate(schemes)}

    others = [point for point in frontier.finished() if point not in front]
    _points(by_time, frontier, others, "o", "0.75", "dominated")
    by_time.plot(
        [point.time for point in front],
        [100.0 * frontier.trusted(point) for point in front],
        color="black",
        linewidth=1.0,
        zorder=2,
    )
    for scheme, marker in markers.items():
        mine = [point for point in front if frontier.scheme(point) == scheme]
        _points(by_time, frontier, mine, marker, "black", scheme)
    for point in front:
        by_time.annotate(
            format_setting(point.settings.get(frontier.refining, "")),
            (point.time, 100.0 * frontier.trusted(point)),
            xytext=(6, 5),
            textcoords="offset points",
            fontsize=8,
        )
    by_time.margins(x=0.12)
    by_time.set_xlabel("wall time [s]")
    kind = "estimated error" if frontier.limits else "error"
    by_time.set_ylabel(f"{kind} [%] of: {frontier.quantity or 'result'}")
    by_time.legend(
        frameon=False,
        fontsize=8,
        loc="best",
        title=f"numbers: {frontier.refining}",
        title_fontsize=8,
    )

    for scheme, points in frontier.schemes().items():
        on_front = scheme in markers
        by_spacing.plot(
            [point.spacing for point in points],
            [100.0 * point.error for point in points],
            color="black" if on_front else "0.75",
            linewidth=1.2 if on_front else 0.8,
            marker=markers.get(scheme, "."),
            markersize=5,
            zorder=2 if on_front else 1,
        )
    if line := frontier.second_order():
        spacings, errors = line[0], [100.0 * error for error in line[1]]
        end = (spacings[1], errors[1])
        by_spacing.plot(spacings, errors, ":", color="0.4", linewidth=1.0)
        by_spacing.annotate("order 2", end, (4, -10), textcoords="offset points", fontsize=8)
    by_spacing.set_xlabel("particle spacing [m]")
    by_time.set_xscale("log")  # after all is drawn: limits of equal errors alone would be a warning
    by_time.set_yscale("log")
    by_spacing.set_xscale("log")
    for axis in (by_time.xaxis, by_spacing.xaxis, by_time.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")
    for axes in (by_time, by_spacing):
        axes.grid(color="0.92", which="both", linewidth=0.6)
        axes.set_axisbelow(True)
    figure.suptitle(title, fontsize=12)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def _points(
    axes: Axes,
    frontier: Frontier,
    points: Sequence[Point],
    marker: str,
    color: str,
    label: str,
) -> None:
    if not points:
        return
    axes.errorbar(
        [point.time for point in points],
        [100.0 * frontier.trusted(point) for point in points],
        xerr=[
            [point.time - min(point.seconds) for point in points],
            [max(point.seconds) - point.time for point in points],
        ],
        fmt=marker,
        color=color,
        markersize=5,
        elinewidth=0.8,
        label=label,
        zorder=3 if color == "black" else 1,
    )
