"""Interactive figures of a report: error against a cost, and against spacing.

They are data that Plotly draws in the browser. Text in them is escaped, because Plotly interprets
HTML tags in labels.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib import import_module
from itertools import cycle
from math import inf, isfinite
from typing import Any

import attrs

from solidsph.errors import SceneError
from solidsph.studies.frontier import Cost, Frontier
from solidsph.studies.point import Point, format_setting

# Distinct without colour, by shape before fill.
_SYMBOLS = (
    *("circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "star"),
    *("hexagon", "pentagon", "circle-open", "square-open", "diamond-open", "triangle-up-open"),
)
_DASHES = ("solid", "dash", "dot", "dashdot")
_GREY, _BLACK = "#a6a6a6", "#000000"


@attrs.frozen
class Expense:
    """A cost to plot errors against."""

    name: str
    unit: str
    of: Cost

    @property
    def heading(self) -> str:
        """Title of its axis."""
        return f"{self.name} [{self.unit}]"

    def fits(self, frontier: Frontier) -> bool:
        """Whether a logarithmic axis can show it for every finished point."""
        return all(0.0 < self.of(point) < inf for point in frontier.finished())


TIME = Expense("wall time", "s", lambda point: point.time)
EXPENSES = (
    TIME,
    Expense("pair evaluations", "-", lambda point: point.pair_evaluations),
    Expense("peak memory", "MiB", lambda point: point.peak_memory / 2**20),
)


def library() -> str:
    """Plotly's script, in full, to be written into the page.

    Raises:
        SceneError: Plotly is not installed.
    """
    script: str = _plotly("plotly.offline").get_plotlyjs()
    return script


def drawable(point: Point) -> bool:
    """Whether a logarithmic axis can show the error of a point."""
    return point.finished and point.error > 0.0


@attrs.frozen
class Figures:
    """Figures of a sweep as data, in which `customdata` is the number of a point."""

    frontier: Frontier

    def against(self, expense: Expense) -> Mapping[str, Any]:
        """Trusted error against a cost: the front in black with a line, the rest in grey."""
        front = [point for point in self.frontier.front(expense.of) if drawable(point)]
        known = self.frontier.numbers(front)
        others = [
            point
            for number, point in enumerate(self.frontier.points)
            if drawable(point) and number not in known
        ]
        refining = _words(self.frontier.refining)
        traces = [
            self._dots(others, expense, "dominated", marker={"color": _GREY, "size": 8}),
            {
                "x": [expense.of(point) for point in front],
                "y": [100.0 * self.frontier.trusted(point) for point in front],
                "mode": "lines",
                "line": {"color": _BLACK, "width": 1.2},
                "hoverinfo": "skip",
                "showlegend": False,
            },
            *(
                self._dots(
                    [point for point in front if self.frontier.scheme(point) == scheme],
                    expense,
                    f"front: {_words(scheme)}",
                    mode="markers+text",
                    marker={"color": _BLACK, "size": 10, "symbol": symbol, "line": {"width": 1.5}},
                    textposition="top right",
                )
                for scheme, symbol in self._symbols(expense).items()
            ),
            _CHOSEN,
        ]
        return self._figure(
            [trace for trace in traces if trace["x"] or trace is _CHOSEN],
            expense.heading,
            f"Error against {expense.name}<br><sub>numbers: {refining}</sub>",
        )

    def against_spacing(self, expense: Expense) -> Mapping[str, Any]:
        """Error against spacing, a line for every scheme; those on the front in black."""
        symbols = self._symbols(expense)
        traces: list[dict[str, Any]] = []
        for scheme, points in self.frontier.schemes().items():
            there = [point for point in points if drawable(point) and isfinite(point.spacing)]
            on_front = scheme in symbols
            first_grey = not on_front and not any(t["legendgroup"] == "others" for t in traces)
            traces.append(
                {
                    "x": [point.spacing for point in there],
                    "y": [100.0 * point.error for point in there],
                    "mode": "lines+markers",
                    "line": {
                        "color": _BLACK if on_front else _GREY,
                        "width": 1.5 if on_front else 1.0,
                        "dash": _DASHES[len(traces) % len(_DASHES)] if on_front else "solid",
                    },
                    "marker": {"size": 8 if on_front else 5, "symbol": symbols.get(scheme, 0)},
                    "name": _words(scheme) if on_front else "schemes off the front",
                    "legendgroup": _words(scheme) if on_front else "others",
                    "showlegend": on_front or first_grey,
                    **self._hover(there),
                }
            )
        # Black is drawn over grey.
        traces.sort(key=lambda trace: trace["line"]["color"], reverse=True)
        if line := self.frontier.second_order():
            traces.append(
                {
                    "x": line[0],
                    "y": [100.0 * error for error in line[1]],
                    "mode": "lines",
                    "line": {"color": "#666666", "width": 1.0, "dash": "dot"},
                    "name": "order 2",
                    "hoverinfo": "skip",
                }
            )
        return self._figure(
            [*traces, _CHOSEN],
            "particle spacing [m]",
            "Error against spacing, by scheme",
        )

    def _symbols(self, expense: Expense) -> Mapping[str, str]:
        """Symbol of every scheme on a front; a scheme on several fronts has the same on all."""
        fronts = {
            other.name: [self.frontier.scheme(point) for point in self.frontier.front(other.of)]
            for other in EXPENSES
        }
        schemes = dict.fromkeys(scheme for front in fronts.values() for scheme in front)
        symbols = zip(schemes, cycle(_SYMBOLS), strict=False)
        return {scheme: mark for scheme, mark in symbols if scheme in fronts[expense.name]}

    def _dots(
        self, points: Sequence[Point], expense: Expense, name: str, **look: Any
    ) -> dict[str, Any]:
        bars = expense is TIME and any(len(point.seconds) > 1 for point in points)
        return {
            "x": [expense.of(point) for point in points],
            "y": [100.0 * self.frontier.trusted(point) for point in points],
            "mode": "markers",
            "name": name,
            "text": [
                _words(format_setting(point.settings.get(self.frontier.refining, "")))
                for point in points
            ],
            **look,
            **({"error_x": _repeats(points, look["marker"]["color"])} if bars else {}),
            **self._hover(points),
        }

    def _hover(self, points: Sequence[Point]) -> dict[str, Any]:
        return {
            "customdata": self.frontier.numbers(points),
            "hovertext": [hover_text(point) for point in points],
            "hoverinfo": "text",
        }

    def _figure(self, traces: Sequence[Any], across: str, title: str) -> Mapping[str, Any]:
        quantity = self.frontier.quantity or "result"
        axis = {
            "type": "log",
            "tickformat": "~g",
            "nticks": 3,  # which gives 1, 2 and 5 of each of two decades
            "gridcolor": "#e6e6e6",
            "linecolor": _BLACK,
            "showline": True,
            "ticks": "outside",
            "automargin": True,
        }
        go = _plotly("plotly.graph_objects")
        figure = go.Figure(
            data=[go.Scatter(trace) for trace in traces],
            layout={
                "template": "none",
                "title": {"text": title, "x": 0.0, "xref": "paper", "font": {"size": 16}},
                "xaxis": {**axis, "title": {"text": across}},
                "yaxis": {**axis, "title": {"text": f"error [%] of: {_words(quantity)}"}},
                "hovermode": "closest",
                "hoverlabel": {"bgcolor": "white", "font": {"color": _BLACK}, "align": "left"},
                "legend": {"orientation": "h", "yanchor": "top", "y": -0.2, "x": 0.0},
                "margin": {"l": 60, "r": 25, "t": 60, "b": 50},
                "font": {"family": "system-ui, sans-serif", "color": _BLACK},
            },
        )
        made: dict[str, Any] = json.loads(figure.to_json())
        return made


# Ring around the point chosen in the page; empty at first.
_CHOSEN: Mapping[str, Any] = {
    "x": [],
    "y": [],
    "mode": "markers",
    "name": "chosen",
    "marker": {"symbol": "circle-open", "size": 20, "color": _BLACK, "line": {"width": 2.5}},
    "hoverinfo": "skip",
    "showlegend": False,
}


def hover_text(point: Point) -> str:
    """All data of a point, a line each, as a label of Plotly."""
    lines = [f"{name}: {format_setting(value)}" for name, value in point.settings.items()]
    lines += [
        f"error: {100.0 * point.error:.3g} % of {point.quantity or 'the result'}",
        f"wall time: {_range(point)}",
        f"steps: {point.steps}",
        f"pair evaluations: {point.pair_evaluations:.4g}",
        f"peak memory: {point.peak_memory / 2**20:.4g} MiB",
        f"particles: {point.particles}, spacing {point.spacing:.3g} m",
        f"outcome: {point.outcome}",
    ]
    return "<br>".join(map(_words, lines))


def _range(point: Point) -> str:
    if len(point.seconds) == 1:
        return f"{point.time:.3g} s"
    return (
        f"{point.time:.3g} s, from {min(point.seconds):.3g} to {max(point.seconds):.3g} s in "
        f"{len(point.seconds)} repeats"
    )


def _repeats(points: Sequence[Point], color: str) -> dict[str, Any]:
    """Error bars from the quickest repeat to the slowest."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [max(point.seconds) - point.time for point in points],
        "arrayminus": [point.time - min(point.seconds) for point in points],
        "color": color,
        "thickness": 1.0,
        "width": 3,
    }


def _words(text: str) -> str:
    """`text` escaped for Plotly, which knows tags but no entity for a quotation mark."""
    return escape(text, quote=False)


def _plotly(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as cause:
        raise SceneError(
            f"a report needs Plotly, which cannot be imported here ({cause}); install it with "
            "pip install 'solidsph[report]'"
        ) from None
