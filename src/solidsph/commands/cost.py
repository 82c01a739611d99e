"""solidsph cost: error against time for a scene or a case, and the best configuration."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import Any

import attrs
import click

from solidsph.commands.console import Table, present, progress, sweep_progress
from solidsph.commands.cost_options import axes_of, case_of, goal_of, seconds
from solidsph.commands.limit_tables import ESTIMATED, limit_rows, measured_table, with_warnings
from solidsph.commands.options import (
    Output,
    SearchOptions,
    flag,
    option,
    option_group,
    options,
    output_option,
    set_option,
)
from solidsph.commands.refined import refined, refinement_facts
from solidsph.commands.target import name_of, resolve, target_argument
from solidsph.errors import SceneError
from solidsph.studies.case import Case
from solidsph.studies.cluster import Cluster
from solidsph.studies.cost import Axes, SweepSetup, default_settings, find_best, frontier
from solidsph.studies.frontier import Frontier
from solidsph.studies.larger_step import ERROR, TIME, at_largest_step, larger_step_sentence
from solidsph.studies.point import Point, measured
from solidsph.studies.processes import Processes
from solidsph.studies.report import write_report
from solidsph.studies.report_figures import library
from solidsph.studies.richardson import extrapolate
from solidsph.studies.scene_case import ABOUT, COARSER, SceneCase
from solidsph.studies.search import Goal, SearchResult
from solidsph.studies.variant import with_settings


@attrs.frozen
class _Options(Output):
    settings: tuple[str, ...] = set_option()
    references: tuple[str, ...] = option(
        "For a scene: what a column should be, a number, a formula of t, or a file of times and "
        "values.  [default: errors are estimated by refinement]",
        "--reference",
        multiple=True,
        metavar="[NAME=]VALUE|FILE",
    )
    axes: tuple[str, ...] = option(
        "Values to try; the first axis refines, from coarse to fine.  [default: the case's own; "
        "three spacings of a scene]",
        "--axis",
        multiple=True,
        metavar="NAME=VALUE,VALUE...",
    )
    accuracy: str | None = option(
        "Find the quickest configuration with this error, such as 1%.", metavar="PERCENT"
    )
    time: str | None = option(
        "Find the most accurate configuration in this time, such as 60s.", metavar="TIME"
    )
    refine: bool = flag(
        "For a scene: run it first, and let its spacings follow its error: fine where the stress "
        "bends most."
    )
    search: SearchOptions = option_group(SearchOptions)
    repeats: int = option(
        "Number of runs of every configuration.",
        type=click.IntRange(1),
        default=1,
        show_default=True,
    )
    workers: int = option(
        "Processes at a time; with more than one, wall times are those of a shared machine.",
        type=click.IntRange(1),
        default=1,
        show_default=True,
    )
    scheduler: str | None = option("Run on the Dask cluster at this address.", metavar="ADDRESS")
    output: Path | None = output_option(
        "Folder for points, picture and scenes.  [default: results/cost/NAME]"
    )
    report: bool = flag(
        "Also write an HTML page with interactive plots and the scene of every point."
    )

    def folder(self, target: str) -> Path:
        """Folder of the results."""
        return self.output or Path("results") / "cost" / target


@click.command()
@target_argument()
@options(_Options)
def cost(target: str, options: _Options) -> None:
    """Show the time that accuracy costs for a scene or a case.

    A scene without a reference is run at three spacings or more, and the error of each is estimated
    from what they tend to. With --refine its spacings follow its error first, and these three are
    about the refined ones. Finished points are kept: the same command continues an interrupted
    sweep.
    """
    goal = goal_of(options.accuracy, options.time)
    wanted, given = resolve(target, options.settings), target
    target = name_of(target)
    if options.accuracy is not None and options.time is not None:
        raise SceneError("--accuracy and --time are two questions; ask one at a time")
    if options.report and goal is not None:
        raise SceneError(
            "--report shows a sweep, not a search; leave out --accuracy and --time: what a search "
            "has run, the sweep takes from the journal"
        )
    if options.report:
        library()  # refused before anything runs if Plotly is missing
    made = None
    if options.refine:
        made = refined(wanted, target, options.folder(target), shown=options.progress)
        wanted = made.scene
    levels = ABOUT if made is not None and made.bodies else COARSER
    with progress(options.progress):
        case = case_of(wanted, given, options.search.of, options.references, levels)
    axes = axes_of(options.axes, case)
    scheduler = options.scheduler
    runner = Processes(options.workers) if scheduler is None else Cluster(scheduler)
    with sweep_progress(target, options.progress) as watch:
        setup = SweepSetup(runner, options.folder(target), options.repeats, watch)
        if goal is None:
            facts, text, passed = _sweep(target, options, case, axes, setup)
        else:
            facts, text, passed = _search(target, options, case, axes, setup, goal)
    if made is not None:
        facts = {**facts, "refined": refinement_facts(made)}
        text = chain(made.sentences, [f"scene: {made.path}"] if made.bodies else [], text)
    present(facts, text, as_json=options.as_json, passed=passed)


Presentation = tuple[Mapping[str, Any], Iterator[Table | str], bool]
"""Facts for programs, text for people, and whether it succeeded."""


def _sweep(
    target: str, options: _Options, case: Case, axes: Axes, setup: SweepSetup
) -> Presentation:
    from solidsph.studies.frontier_picture import draw_frontier

    folder = options.folder(target)
    result = frontier(case, axes, setup)
    faster = at_largest_step(case, result, setup)
    known = {id(one.usual): one.row for one in faster}
    unknown = {ERROR: "", TIME: ""} if faster else {}
    rows = [
        {**row, **known.get(id(point), unknown)}
        for row, point in zip(result, result.points, strict=True)
    ]
    own = default_settings(case.priced(), axes)
    default = next((point for point in result.points if point.settings == own), None)
    picture, table = folder / f"{target}-frontier.png", folder / f"{target}-points.csv"
    is_drawn = bool(result.finished())
    if is_drawn:
        draw_frontier(result, case.priced().title, picture)
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    page = folder / f"{target}-report.html" if options.report else None
    if page is not None:
        write_report(result, case, page, faster=faster)
    facts = {
        "case": target,
        "is a scene": isinstance(case, SceneCase),
        "points": rows,
        "orders": [
            {
                "scheme": dict(orders.settings),
                "in spacing": orders.in_spacing,
                "in time": orders.in_time,
                "crosses": orders.crosses,
            }
            for orders in result.orders()
        ],
        "without a reference": _extrapolations(result),
        "measured": measured(result.points) if result.unjudged else [],
        "time for the next digit": result.next_digit(),
        "default": None
        if default is None
        else {
            "error": default.error,
            "time [s]": default.time,
            "times the front": result.excess(default),
        },
        "sentence": result.sentence(),
        "largest step": larger_step_sentence(faster),
        "picture": str(picture) if is_drawn else None,
        "table": str(table),
        "report": None if page is None else str(page),
    }
    return facts, _sweep_text(facts, result, default, options.verbose), is_drawn


def _sweep_text(
    facts: Mapping[str, Any], result: Frontier, default: Point | None, verbose: bool
) -> Iterator[Table | str]:
    if result.finished():
        yield _points_table(
            f"{facts['case']}: the front, of {len(result)} configurations",
            result.front(),
            verbose,
            {"trusted [%]": [100.0 * result.trusted(point) for point in result.front()]},
        )
        yield Table(
            "orders, by scheme",
            ["scheme", "in spacing", "in time", "falls steadily"],
            [[o.label, o.in_spacing, o.in_time, not o.crosses] for o in result.orders()],
        )
    if result.limits:
        yield from with_warnings(ESTIMATED, facts["without a reference"])
    elif bars := facts["without a reference"]:
        yield Table.of("without the reference: extrapolation", bars, list(bars[0]))
    if result.unjudged:
        yield from measured_table(result.points)
    for point in result.points:
        if not point.ran:
            yield f"failed: {point.label()}: {point.failure}"
    if default is not None:
        excess = result.excess(default)
        place = f"{default.brief()}: on the front"
        if default.ran and not default.finished:
            place = f"{default.label()}: its error is not known"
        elif not isfinite(excess):
            place = f"{default.label()}: failed"
        elif excess != 1.0:
            more = f"{excess:.2g} times the time of an equally accurate one on the front"
            place = f"{default.brief()}: {more}"
        whose = "the scene as it is" if facts["is a scene"] else "the case's own parameters"
        yield f"{whose}: {place}"
    yield facts["sentence"]
    if facts["largest step"]:
        yield facts["largest step"]
    if facts["picture"] is not None:
        yield f"picture: {facts['picture']}"
    yield f"all points: {facts['table']}"
    if facts["report"] is not None:
        yield f"report: {facts['report']}"


def _extrapolations(result: Frontier) -> Sequence[Mapping[str, Any]]:
    """Error bar of every scheme on the front that has three points or more."""
    if result.limits:
        return limit_rows(result.limits)
    bars = []
    on_front = {result.scheme(point) for point in result.front()}
    for scheme, points in result.schemes().items():
        values = [point.value for point in points if point.value is not None]
        if scheme not in on_front or len(points) < 3 or len(values) < len(points):
            continue
        if points[-1].reference is None:
            continue  # its value is the error itself
        limit = extrapolate([point.spacing for point in points], values)
        bars.append(
            {
                "scheme": scheme,
                "finest": values[-1],
                "limit": limit.limit,
                "order": limit.order,
                "bar [%]": 100.0 * limit.index,
                "true error [%]": 100.0 * points[-1].error,
                "warning": limit.warning,
            }
        )
    return bars


def _search(
    target: str, options: _Options, case: Case, axes: Axes, setup: SweepSetup, goal: Goal
) -> Presentation:
    longest = seconds(options.search.longest, "--longest")
    result = find_best(case, goal, axes, setup, longest=longest)
    best = result.point
    scenes = list(_write_scenes(target, options.folder(target), case, result))
    facts = {
        "case": target,
        "found": None if best is None else _facts(best),
        "tried": [_facts(point) for point in result.tried],
        "measured": [] if result.limits else measured(result.tried),
        "spent [s]": result.spent,
        "sure": result.sure,
        "estimated": limit_rows(result.limits),
        "scenes": [str(path) for path in scenes],
    }
    return facts, _search_text(facts, result, options.verbose), best is not None


def _search_text(
    facts: Mapping[str, Any], result: SearchResult, verbose: bool
) -> Iterator[Table | str]:
    judged = [point for point in result.tried if point.finished]
    if judged:
        yield _points_table(f"{facts['case']}: configurations tried", result.tried, verbose)
    else:
        yield from measured_table(result.tried)
    yield from with_warnings(ESTIMATED, facts["estimated"])
    yield f"{result.sure}; the search took {result.spent:.3g} s of runs"
    yield from (f"scene: {path}" for path in facts["scenes"])
    if result.point is None and not judged:
        yield "found: nothing"
    elif result.point is None:
        yield "found: nothing; give finer values by --axis, or a longer time by --longest"
    else:
        yield f"found: {result.point.brief()}"


def _write_scenes(target: str, folder: Path, case: Case, result: SearchResult) -> Iterator[Path]:
    """Write the scenes of the best point to files that begin with its evidence."""
    point = result.point
    if point is None:
        return
    scenes = with_settings(case.priced(), point.settings).scenes()
    evidence = (f"{point.brief()}, of: {point.quantity}", result.sure, f"solidsph cost {target}")
    heading = "".join(f"# {line}\n" for line in evidence)
    for name, scene in scenes.items():
        path = folder / (f"{target}.toml" if len(scenes) == 1 else f"{target}-{name}.toml")
        path.write_text(f"{heading}\n{scene.to_toml(path.parent)}", encoding="utf-8")
        yield path


def _facts(point: Point) -> Mapping[str, Any]:
    return {
        "settings": dict(point.settings),
        "error": point.error,
        "time [s]": point.time,
        "steps": point.steps,
        "pair evaluations": point.pair_evaluations,
        "bytes touched": point.bytes_touched,
        "peak memory [bytes]": point.peak_memory,
        "outcome": point.outcome,
    }


def _points_table(
    title: str,
    points: Sequence[Point],
    verbose: bool,
    after_error: Mapping[str, Sequence[float]] | None = None,
) -> Table:
    """Table of points, with more columns after that of the error."""
    columns = {
        "configuration": [point.label() for point in points],
        "error [%]": [100.0 * point.error for point in points],
        **(after_error or {}),
        "time [s]": [point.time for point in points],
        "steps": [point.steps for point in points],
        "pair evaluations": [point.pair_evaluations for point in points],
        "memory [MiB]": [point.peak_memory / 2**20 for point in points],
    }
    if verbose:
        columns["bytes touched"] = [float(point.bytes_touched) for point in points]
    return Table(title, list(columns), list(zip(*columns.values(), strict=True)))
