"""solidsph cost: error against time for a case, and what an accuracy or a time buys."""

from __future__ import annotations

import csv
import re
import tomllib
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from solidsph.commands.console import say, show_json, show_table, sweep_progress
from solidsph.commands.target import parameters, resolve
from solidsph.errors import SceneError
from solidsph.studies.case import Case

if TYPE_CHECKING:
    from solidsph.studies.cost import Axes, SweepSetup
    from solidsph.studies.frontier import Frontier
    from solidsph.studies.point import Point
    from solidsph.studies.search import SearchResult


@click.command()
@click.argument("target", metavar="CASE")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A case's parameter.")
@click.option(
    "--axis",
    "wanted_axes",
    multiple=True,
    metavar="NAME=VALUE,VALUE...",
    help="Values to try; the first axis refines, from coarse to fine.  [default: the case's own]",
)
@click.option("--accuracy", metavar="PERCENT", help="Find the cheapest for this, such as 1%.")
@click.option(
    "--time", "time_wanted", metavar="TIME", help="Find the nearest in this, such as 60s."
)
@click.option(
    "--repeats", type=click.IntRange(1), default=1, show_default=True, help="Of each run."
)
@click.option(
    "--workers",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    help="Processes at a time; with more than one, wall times are those of a shared machine.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Run on the Dask cluster at this address.")
@click.option(
    "--longest",
    default="10min",
    show_default=True,
    metavar="TIME",
    help="A search runs nothing that it expects to take longer.",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for points, picture and scenes.  [default: results/cost/CASE]",
)
@click.option(
    "--report",
    is_flag=True,
    help="Write a page of HTML too, with plots to explore and the scene of every point.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
def cost(
    target: str,
    settings: tuple[str, ...],
    wanted_axes: tuple[str, ...],
    accuracy: str | None,
    time_wanted: str | None,
    repeats: int,
    workers: int,
    scheduler: str | None,
    longest: str,
    output: Path | None,
    report: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Show what accuracy costs in time for a case. What has run is kept: the same command goes on
    where another was ended."""
    from solidsph.studies.cost import SweepSetup
    from solidsph.studies.processes import Processes

    case = resolve(target, settings)
    if not isinstance(case, Case):
        raise SceneError(f"{target!r} is a scene, which has no reference; give a case")
    if accuracy is not None and time_wanted is not None:
        raise SceneError("--accuracy and --time are two questions; ask one at a time")
    if report and (accuracy is not None or time_wanted is not None):
        raise SceneError(
            "--report shows a sweep, not a search; leave out --accuracy and --time: what a search "
            "has run, the sweep takes from the journal"
        )
    if report:
        from solidsph.studies.report_figures import library

        library()  # missed before anything has run
    runner: Any = Processes(workers)
    if scheduler is not None:
        from solidsph.studies.cluster import Cluster  # brings the cluster's library with it

        runner = Cluster(scheduler)
    folder = output or Path("results") / "cost" / target
    axes = _axes(wanted_axes, case)
    with sweep_progress(target, not (as_json or quiet)) as watch:
        means = SweepSetup(runner, folder, repeats, watch)
        goal = _goal(accuracy, time_wanted)
        if goal is None:
            _sweep(target, case, axes, means, folder, report, as_json)
        else:
            _search(target, case, goal, axes, means, folder, seconds(longest, "--longest"), as_json)


def _sweep(
    target: str,
    case: Case,
    axes: Axes,
    means: SweepSetup,
    folder: Path,
    report: bool,
    as_json: bool,
) -> None:
    from solidsph.studies.cost import default_settings, frontier
    from solidsph.studies.frontier_picture import draw_frontier
    from solidsph.studies.report import write_report

    made = frontier(case, axes, means)
    rows = list(made)
    own = default_settings(case.priced(), axes)
    default = next((point for point in made.points if point.settings == own), None)
    picture, table = folder / f"{target}-frontier.png", folder / f"{target}-points.csv"
    if made.finished():
        draw_frontier(made, case.priced().title, picture)
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    page = folder / f"{target}-report.html" if report else None
    if page is not None:
        write_report(made, case, page)
    bars = _bars(made)
    if as_json:
        show_json(
            {
                "case": target,
                "points": rows,
                "orders": [
                    {
                        "scheme": dict(one.settings),
                        "in spacing": one.in_spacing,
                        "in time": one.in_time,
                        "crosses": one.crosses,
                    }
                    for one in made.orders()
                ],
                "without a reference": bars,
                "time for the next digit": made.next_digit(),
                "default": None if default is None else _default(made, default),
                "sentence": made.sentence(),
                "picture": str(picture),
                "table": str(table),
                "report": None if page is None else str(page),
            }
        )
    else:
        _show(target, made, default, bars)
        say(f"picture: {picture}")
        say(f"all points: {table}")
        if page is not None:
            say(f"report: {page}")
    if not made.finished():
        raise SystemExit(1)


def _show(target: str, made: Frontier, default: Point | None, bars: Sequence[Any]) -> None:
    show_table(
        f"{target}: the front, of {len(made)} configurations",
        [
            *("configuration", "error [%]", "trusted [%]", "time [s]"),
            *("steps", "pair evaluations", "bytes touched", "memory [MiB]"),
        ],
        [
            [*_row(point)[:2], 100.0 * made.trusted(point), *_row(point)[2:]]
            for point in made.front()
        ],
    )
    show_table(
        "orders, by scheme",
        ["scheme", "in spacing", "in time", "falls steadily"],
        [
            [_scheme(one.settings), one.in_spacing, one.in_time, not one.crosses]
            for one in made.orders()
        ],
    )
    if bars:
        show_table(
            "without the reference: what the three finest spacings tend to",
            ["scheme", "finest", "limit", "order", "bar [%]", "true error [%]", "warning"],
            [list(bar.values()) for bar in bars],
        )
    failed = [point for point in made.points if not point.finished]
    for point in failed:
        say(f"failed: {point.label()}: {point.outcome.splitlines()[0]}")
    if default is not None:
        excess = made.excess(default)
        place = (
            "on the front"
            if excess == 1.0
            else f"{excess:.2g} times the time of what is as near on the front"
            if isfinite(excess)
            else "failed"
        )
        say(f"the case's own parameters: {_brief(default)}: {place}")
    say(made.sentence())


def _default(made: Frontier, point: Point) -> Mapping[str, Any]:
    return {"error": point.error, "time [s]": point.time, "times the front": made.excess(point)}


def _bars(made: Frontier) -> Sequence[Mapping[str, Any]]:
    """Of every scheme on the front of which there are three points: its error bar."""
    from solidsph.studies.richardson import extrapolate

    bars = []
    on_front = {made.scheme(point) for point in made.front()}
    for scheme, points in made.schemes().items():
        values = [point.value for point in points if point.value is not None]
        if scheme not in on_front or len(points) < 3 or len(values) < len(points):
            continue
        if points[-1].reference is None:
            continue  # its value is the error itself
        found = extrapolate([point.spacing for point in points], values)
        bars.append(
            {
                "scheme": scheme,
                "finest": values[-1],
                "limit": found.limit,
                "order": found.order,
                "bar [%]": 100.0 * found.index,
                "true error [%]": 100.0 * points[-1].error,
                "warning": found.warning,
            }
        )
    return bars


def _search(
    target: str,
    case: Case,
    goal: Any,
    axes: Axes,
    means: SweepSetup,
    folder: Path,
    longest: float,
    as_json: bool,
) -> None:
    from solidsph.studies.cost import find_best

    found = find_best(case, goal, axes, means, longest=longest)
    scenes = [] if found.point is None else _scenes(target, case, found, folder)
    if as_json:
        show_json(
            {
                "case": target,
                "found": None if found.point is None else _facts(found.point),
                "tried": [_facts(point) for point in found.tried],
                "spent [s]": found.spent,
                "sure": found.sure,
                "scenes": [str(path) for path in scenes],
            }
        )
    else:
        show_table(
            f"{target}: what was tried",
            [
                "configuration",
                "error [%]",
                "time [s]",
                "steps",
                "pair evaluations",
                "bytes touched",
                "memory [MiB]",
            ],
            [_row(point) for point in found.tried],
        )
        say(f"{found.sure}; {found.spent:.3g} s of runs")
        for path in scenes:
            say(f"scene: {path}")
        if found.point is None:
            say("found: nothing; give finer values by --axis, or more by --longest")
        else:
            say(f"found: {_brief(found.point)}")
    if found.point is None:
        raise SystemExit(1)


def _scenes(target: str, case: Case, found: SearchResult, folder: Path) -> Sequence[Path]:
    """The scenes of what was found, each a file with its evidence at the top."""
    from solidsph.studies.variant import with_settings

    point = found.point
    assert point is not None
    paths = []
    scenes = with_settings(case.priced(), point.settings).scenes()
    for name, scene in scenes.items():
        path = folder / (f"{target}.toml" if len(scenes) == 1 else f"{target}-{name}.toml")
        evidence = (
            f"# {_brief(point)}, of: {point.quantity}",
            f"# {found.sure}",
            f"# solidsph cost {target}",
        )
        path.write_text("\n".join([*evidence, "", scene.to_toml()]), encoding="utf-8")
        paths.append(path)
    return paths


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


def _row(point: Point) -> list[Any]:
    return [
        point.label(),
        100.0 * point.error,
        point.time,
        point.steps,
        point.pair_evaluations,
        float(point.bytes_touched),
        point.peak_memory / 2**20,
    ]


def _brief(point: Point) -> str:
    return f"{point.label()}: {100.0 * point.error:.2g} % in {point.time:.2g} s"


def _scheme(settings: Mapping[str, Any]) -> str:

    from solidsph.studies.point import format_setting

    return (
        ", ".join(f"{name} {format_setting(value)}" for name, value in settings.items())
        or "as it is"
    )


def _axes(wanted: Sequence[str], case: Case) -> Axes:
    """Those of the command line after the one that refines; the case's own if there are none."""
    from solidsph.studies.cost import sweep_of

    if not wanted:
        return sweep_of(case.priced())
    axes = dict(_axis(one) for one in wanted)
    refining, values = next(iter(case.priced().sweep.items()), ("", ()))
    if refining and refining not in axes:
        return {refining: values, **axes}
    return {name: axes[name] for name in sorted(axes, key=lambda name: name != refining)}


def _axis(text: str) -> tuple[str, Sequence[Any]]:
    name, equals, values = text.partition("=")
    if not equals or not name.strip() or not values.strip():
        raise SceneError(f"--axis {text!r} is not of the form name=value,value")
    try:
        parsed = tomllib.loads(f"values = [{values}]")["values"]
    except tomllib.TOMLDecodeError:
        several = (parameters([f"value={value.strip()}"]) for value in values.split(","))
        parsed = [one["value"] for one in several]
    parsed = [tuple(value) if isinstance(value, list) else value for value in parsed]
    if len({repr(value) for value in parsed}) < len(parsed):
        raise SceneError(f"--axis {text!r} has a value twice; give each once")
    return name.strip(), parsed


def _goal(accuracy: str | None, time: str | None) -> Any:
    from solidsph.studies.search import Accuracy, TimeLimit

    if accuracy is not None:
        return Accuracy(_part(accuracy))
    return None if time is None else TimeLimit(seconds(time, "--time"))


def _part(text: str) -> float:
    """ "1%" or "0.01" as a number."""
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(%?)\s*", text)
    try:
        value = float(match[1]) if match else 0.0
    except ValueError:
        value = 0.0
    if match and match[2]:
        value /= 100.0
    if not 0.0 < value < 1.0:
        raise SceneError(f"--accuracy must be between 0 and 100 %, such as 1%, got {text!r}")
    return value


_UNITS = {"": 1.0, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def seconds(text: str, option: str) -> float:
    """ "60s", "2min" or "1h" in seconds."""
    match = re.fullmatch(r"\s*([0-9.]+(?:[eE][+-]?\d+)?)\s*([a-z]*)\s*", text)
    try:
        value = float(match[1]) * _UNITS[match[2]] if match else 0.0
    except (ValueError, KeyError):
        value = 0.0
    if not 0.0 < value < 1e9:
        raise SceneError(f"{option} must be a time, such as 60s, 2min or 1h, got {text!r}")
    return value
