"""The interactive figures of a report: error against a cost, and against spacing.

They are made as data, which Plotly draws in the browser; text in them is escaped, because Plotly
takes tags of HTML in its labels.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib import import_module
from math import inf, isfinite
from typing import Any

import attrs

from solidsph.errors import SceneError
from solidsph.studies.frontier import Cost, Frontier
from solidsph.studies.point import Point, format_setting

# Told apart without colour, and by shape before fill.
_SYMBOLS = (
    *("circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "star"),
    *("hexagon", "pentagon", "circle-open", "square-open", "diamond-open", "triangle-up-open"),
)
_DASHES = ("solid", "dash", "dot", "dashdot")
_GREY, _BLACK = "#a6a6a6", "#000000"


@attrs.frozen
class Expense:
    """A cost that error can be held against."""

    name: str
    unit: str
    of: Cost

    @property
    def heading(self) -> str:
        """Of its axis."""
        return f"{self.name} [{self.unit}]"

    def fits(self, frontier: Frontier) -> bool:
        """Whether a logarithmic axis has a place for it, whatever the point."""
        return all(0.0 < self.of(point) < inf for point in frontier.finished())


TIME = Expense("wall time", "s", lambda point: point.time)
EXPENSES = (
    TIME,
    Expense("pair evaluations", "-", lambda point: point.pair_evaluations),
    Expense("peak memory", "MiB", lambda point: point.peak_memory / 2**20),
)


def library() -> str:
    """Plotly's own script, in full: it is written into the page.

    Raises:
        SceneError: Plotly is not installed.
    """
    script: str = _plotly("plotly.offline").get_plotlyjs()
    return script


def drawable(point: Point) -> bool:
    """Whether a point has an error that a logarithmic axis has a place for."""
    return point.finished and point.error > 0.0


@attrs.frozen
class Figures:
    """Of one sweep: figures as tables of data, in which `customdata` is the number of a point."""

    frontier: Frontier

    def against(self, expense: Expense) -> Mapping[str, Any]:
        """The error to be trusted against a cost: the front in black with a line, the rest grey."""
        front = [point for point in self.frontier.front(expense.of) if drawable(point)]
        known = set(self.numbers(front))
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
        """Error against spacing, a line for every scheme; in black those on the front."""
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
                    **self._spoken(there),
                }
            )
        order = _second_order(self.frontier.finished())
        return self._figure(
            # Black is drawn over grey.
            [*sorted(traces, key=lambda t: t["line"]["color"], reverse=True), *order, _CHOSEN],
            "particle spacing [m]",
            "Error against spacing, by scheme",
        )

    def numbers(self, points: Sequence[Point]) -> Sequence[int]:
        """Places of these points in the sweep, by which the page knows them."""
        places = {id(point): number for number, point in enumerate(self.frontier.points)}
        return [places[id(point)] for point in points]

    def _symbols(self, expense: Expense) -> Mapping[str, str]:
        """A mark for every scheme on the front; a scheme on several fronts keeps its own."""
        all_marks = self._marks()
        wanted = {self.frontier.scheme(point) for point in self.frontier.front(expense.of)}
        return {scheme: mark for scheme, mark in all_marks.items() if scheme in wanted}

    def _marks(self) -> Mapping[str, str]:
        fronts = [self.frontier.front(expense.of) for expense in EXPENSES]
        schemes = dict.fromkeys(self.frontier.scheme(p) for front in fronts for p in front)
        return {scheme: _SYMBOLS[i % len(_SYMBOLS)] for i, scheme in enumerate(schemes)}

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
            **self._spoken(points),
        }

    def _spoken(self, points: Sequence[Point]) -> dict[str, Any]:
        return {
            "customdata": self.numbers(points),
            "hovertext": [spoken(point) for point in points],
            "hoverinfo": "text",
        }

    def _figure(self, traces: Sequence[Any], across: str, title: str) -> Mapping[str, Any]:
        quantity = next((p.quantity for p in self.frontier.points if p.quantity), "result")
        axis = {
            "type": "log",
            "tickformat": "~g",
            "nticks": 3,  # and so 1, 2 and 5 of each decade where there are two
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


# Where the page rings the point that was chosen: it is empty until then.
_CHOSEN: Mapping[str, Any] = {
    "x": [],
    "y": [],
    "mode": "markers",
    "name": "chosen",
    "marker": {"symbol": "circle-open", "size": 20, "color": _BLACK, "line": {"width": 2.5}},
    "hoverinfo": "skip",
    "showlegend": False,
}


def spoken(point: Point) -> str:
    """All that is known of a point, a line each, as Plotly's labels take it."""
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
    said = f"{point.time:.3g} s"
    if len(point.seconds) > 1:
        said += (
            f", from {min(point.seconds):.3g} to {max(point.seconds):.3g} s in "
            f"{len(point.seconds)} repeats"
        )
    return said


def _repeats(points: Sequence[Point], color: str) -> dict[str, Any]:
    """Bars from the quickest repeat to the slowest."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [max(point.seconds) - point.time for point in points],
        "arrayminus": [point.time - min(point.seconds) for point in points],
        "color": color,
        "thickness": 1.0,
        "width": 3,
    }


def _second_order(points: Sequence[Point]) -> Sequence[Mapping[str, Any]]:
    """What second order is, below all errors."""
    errors = [100.0 * point.error for point in points if drawable(point)]
    spacings = [point.spacing for point in points if isfinite(point.spacing)]
    if not errors or not spacings or not 0.0 < min(spacings) < max(spacings):
        return []
    coarse, fine, least = max(spacings), min(spacings), 0.7 * min(errors)
    return [
        {
            "x": [coarse, fine],
            "y": [least * (coarse / fine) ** 2, least],
            "mode": "lines",
            "line": {"color": "#666666", "width": 1.0, "dash": "dot"},
            "name": "order 2",
            "hoverinfo": "skip",
        }
    ]


def _words(text: str) -> str:
    """`text` as Plotly takes it: it knows tags, and no name for a quotation mark."""
    return escape(text, quote=False)


def _plotly(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as cause:
        raise SceneError(
            f"a report needs Plotly, which cannot be imported here ({cause}); install it with "
            "pip install 'solidsph[report]'"
        ) from None
