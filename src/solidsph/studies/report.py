"""Report of a sweep: one HTML page that needs only a browser."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from math import inf, isfinite
from pathlib import Path
from string import Template
from typing import Any, final

import attrs

from solidsph.errors import SolidsphError
from solidsph.run.outcome import FINISHED
from solidsph.studies.case import Case
from solidsph.studies.frontier import AS_IT_IS, Frontier
from solidsph.studies.larger_step import LARGEST, LargerStep, larger_step_sentence
from solidsph.studies.point import Point, format_setting
from solidsph.studies.report_figures import EXPENSES, TIME, Figures, drawable, library
from solidsph.studies.variant import with_settings

_NUMBER = "no."  # heading of the numbers of configurations


def write_report(
    made: Frontier,
    case: Case,
    path: Path,
    *,
    title: str | None = None,
    faster: Sequence[LargerStep] = (),
) -> None:
    """Write a page with plots, a table of all points and the scenes of each.

    It contains Plotly's script, about 5 MB, and needs no network.

    Args:
        made: a sweep over `case`.
        case: its scenes are shown.
        path: of the HTML file.
        title: by default that of the case.
        faster: configurations of `made` with the largest safe time step.

    Raises:
        SceneError: Plotly is not installed.
    """
    page = _Page(made, case.priced(), title, faster)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page.text(), encoding="utf-8")


@attrs.frozen
class _Cell:
    """Text of a cell, and the number that it is sorted by."""

    text: str
    number: float | None = None

    @classmethod
    def of(cls, value: Any, form: str) -> _Cell:
        """Cell of a number in this format, empty if it is not finite, or of any other value."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return cls(format_setting(value))
        if not isfinite(value):
            return cls("")
        return cls(str(value) if isinstance(value, int) else format(value, form), float(value))


@final
@attrs.frozen
class _Page:
    made: Frontier
    case: Case
    title: str | None
    faster: Sequence[LargerStep]

    def text(self) -> str:
        folder = files("solidsph.studies") / "report_page"
        parts = {name: (folder / name).read_text("utf-8") for name in ("page.css", "page.js")}
        points, finished = len(self.made), len(self.made.finished())
        quantity = self.made.quantity
        return Template((folder / "page.html").read_text("utf-8")).substitute(
            title=escape(self.title or self.case.title),
            sentence=escape(self.made.sentence()),
            facts=escape(
                f"{points} configurations, {finished} finished"
                + (f"; error of: {quantity}" if quantity else "")
                + f"; reference: {self.case.source}"
            ),
            version=escape(version("solidsph")),
            style=parts["page.css"],
            choices="".join(self._choices()),
            left_out=self._left_out(),
            faster=self._faster(),
            table=self._table(),
            orders=self._orders(),
            failures=self._failures(),
            data=_embedded(self._data()),
            library=library(),
            script=parts["page.js"],
        )

    def _data(self) -> Mapping[str, Any]:
        figures = Figures(self.made)
        return {
            "expenses": [
                {
                    "front": self.made.numbers(self.made.front(expense.of)),
                    "figures": [figures.against(expense), figures.against_spacing(expense)],
                }
                if expense.fits(self.made)
                else None
                for expense in EXPENSES
            ],
            "points": [
                {
                    "label": point.label() or AS_IT_IS,
                    "brief": _brief(point),
                    "places": _places(point),
                    **self._scenes(number, point),
                }
                for number, point in enumerate(self.made.points, 1)
            ],
        }

    def _scenes(self, number: int, point: Point) -> Mapping[str, Any]:
        """Scenes of one point as TOML with file names, or the reason why there is none."""
        try:
            scenes = with_settings(self.case, point.settings).scenes()
        except SolidsphError as cause:
            return {"scenes": [], "note": f"There is no scene: {cause}"}
        if not scenes:
            return {
                "scenes": [],
                "note": "This case runs no scene: it computes its result.",
            }
        written = []
        for name, scene in scenes.items():
            file = f"{re.sub(r'[^A-Za-z0-9_-]+', '-', name)}-{number}.toml"
            try:
                content = {"toml": scene.to_toml()}
            except SolidsphError as cause:
                content = {"why": f"This scene cannot be written: {cause}"}
            written.append({"name": name, "file": file, **content})
        return {"scenes": written, "note": ""}

    def _choices(self) -> Iterator[str]:
        for number, expense in enumerate(EXPENSES):
            fits = expense.fits(self.made)
            state = "" if fits else ' disabled title="not known of every configuration"'
            yield (
                f'<button type="button" data-expense="{number}" '
                f'aria-pressed="{str(expense is TIME).lower()}"{state}>'
                f"{escape(expense.name)}</button>\n"
            )

    def _left_out(self) -> str:
        exact = [p for p in self.made.finished() if not drawable(p)]
        if not exact:
            return ""
        return (
            f"<p>{len(exact)} of them have an error of exactly 0, which a logarithmic axis cannot "
            "show; they are only in the table.</p>"
        )

    def _faster(self) -> str:
        sentence = larger_step_sentence(self.faster)
        return f'<p id="larger-step">{escape(sentence)}.</p>' if sentence else ""

    def _table(self) -> str:
        columns = [(heading, cells, _class(cells)) for heading, cells in self._columns()]
        headings = "".join(
            f'<th scope="col"{kind}><button type="button">{escape(heading)}</button></th>'
            for heading, _, kind in columns
        )
        front = self.made.numbers(self.made.front())
        rows = []
        for number in range(len(self.made)):
            cells = "".join(
                _td(cells[number], kind, with_button=heading == _NUMBER)
                for heading, cells, kind in columns
            )
            mark = ' class="front"' if number in front else ""
            rows.append(f'<tr data-point="{number}"{mark}>{cells}</tr>')
        body = "\n".join(rows)
        return f"<thead><tr>{headings}</tr></thead>\n<tbody>\n{body}\n</tbody>"

    def _columns(self) -> Sequence[tuple[str, Sequence[_Cell]]]:
        """Headings, which a setting may repeat, and cells of every point."""
        points, front = self.made.points, self.made.numbers(self.made.front())
        names = dict.fromkeys(name for point in points for name in point.settings)
        several = any(len(point.seconds) > 1 for point in points)
        faster = {id(one.usual): one.point for one in self.faster}
        larger = [faster.get(id(point)) for point in points] if faster else []
        return [
            (_NUMBER, _cells(range(1, len(points) + 1))),
            ("front", _cells("front" if n in front else "" for n in range(len(points)))),
            *((name, _cells((p.settings.get(name, "") for p in points), "g")) for name in names),
            ("error [%]", _cells(100.0 * p.error for p in points)),
            ("trusted [%]", _cells(100.0 * self.made.trusted(p) for p in points)),
            ("time [s]", _cells(p.time for p in points)),
            *([("repeats [s]", [_repeats(p) for p in points])] if several else []),
            *(
                [
                    (f"{LARGEST:g} of the step: error [%]", _cells(_percent(p) for p in larger)),
                    ("its time [s]", _cells(p.time if p else inf for p in larger)),
                ]
                if larger
                else []
            ),
            ("spacing [m]", _cells(p.spacing for p in points)),
            ("particles", _cells(p.particles for p in points)),
            ("steps", _cells(p.steps for p in points)),
            ("pair evaluations", _cells((float(p.pair_evaluations) for p in points), ".4g")),
            ("bytes touched", _cells((float(p.bytes_touched) for p in points), ".4g")),
            ("memory [MiB]", _cells((p.peak_memory / 2**20 for p in points), ".4g")),
            ("outcome", _cells(_outcome(p).splitlines()[0] for p in points)),
        ]

    def _orders(self) -> str:
        orders = self.made.orders()
        if not orders:
            return "<p>No scheme has two spacings that finished.</p>"
        rows = "\n".join(
            f'<tr><th scope="row">{escape(order.label)}</th>'
            f'<td class="number">{_order(order.in_spacing)}</td>'
            f'<td class="number">{_order(order.in_time)}</td>'
            f"<td>{'no' if order.crosses else 'yes'}</td></tr>"
            for order in orders
        )
        return (
            '<div class="wide" tabindex="0" role="region" aria-label="orders"><table id="orders">\n'
            '<thead><tr><th scope="col">scheme</th><th scope="col">in spacing</th>'
            '<th scope="col">in time</th><th scope="col">falls steadily</th></tr></thead>\n'
            f"<tbody>\n{rows}\n</tbody></table></div>"
        )

    def _failures(self) -> str:
        failed = [(n, p) for n, p in enumerate(self.made.points, 1) if not p.finished]
        if not failed:
            return "<p>Every configuration finished.</p>"
        items = "\n".join(
            f"<li>{n}, {escape(p.label() or AS_IT_IS)}: <pre>{escape(_outcome(p))}</pre></li>"
            for n, p in failed
        )
        return f'<ul id="failures">\n{items}\n</ul>'


def _cells(values: Iterable[Any], form: str = ".3g") -> Sequence[_Cell]:
    return [_Cell.of(value, form) for value in values]


def _percent(point: Point | None) -> float:
    return 100.0 * point.error if point else inf


def _repeats(point: Point) -> _Cell:
    """Range of repeats, sorted by the quickest."""
    quickest, slowest = min(point.seconds), max(point.seconds)
    return _Cell(f"{quickest:.3g} to {slowest:.3g}", quickest) if isfinite(slowest) else _Cell("")


def _class(cells: Sequence[_Cell]) -> str:
    """Attribute of the cells of a column: whether all are numbers or empty."""
    numeric = all(cell.number is not None or not cell.text for cell in cells)
    return ' class="number"' if numeric else ""


def _td(cell: _Cell, attribute: str, *, with_button: bool) -> str:
    sort = "" if cell.number is None else f' data-number="{cell.number!r}"'
    text = escape(cell.text)
    if with_button:  # reached by the keyboard; its label says whose scene it shows
        text = f'<button type="button" aria-label="scene of configuration {text}">{text}</button>'
    return f"<td{attribute}{sort}>{text}</td>"


def _outcome(point: Point) -> str:
    if point.outcome == FINISHED and not point.finished:
        return "finished, with an error that is not finite"
    return point.outcome or "unknown"


def _brief(point: Point) -> str:
    if not point.finished:
        return _outcome(point)
    return f"{100.0 * point.error:.3g} % in {point.time:.3g} s"


def _places(point: Point) -> Mapping[str, Any] | None:
    """Coordinates of a point for each cost; None if it is not drawn."""
    if not drawable(point):
        return None
    return {
        "costs": [expense.of(point) for expense in EXPENSES],
        "spacing": point.spacing if isfinite(point.spacing) else None,
        "error": 100.0 * point.error,
    }


def _order(value: float) -> str:
    return f"{value:.2f}" if isfinite(value) else "none"


def _embedded(data: Mapping[str, Any]) -> str:
    """`data` as JSON whose texts cannot end an HTML element."""
    text = json.dumps(data, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
