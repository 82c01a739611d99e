"""What accuracy costs: the frontiers of the documented cases, and our defaults beside them.

python benchmarks/frontiers.py                                        all cases, to the terminal
python benchmarks/frontiers.py csm3 --write docs/what-accuracy-costs.md

Every configuration runs in a process of its own, one at a time. What has run is kept in
results/frontiers: the same command goes on where another was ended; remove that folder to measure
anew.
"""

from __future__ import annotations

import argparse
import datetime
import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from table import Table

from solidsph.errors import BuildError, SceneError
from solidsph.registry import registry
from solidsph.simulation import Simulation
from solidsph.studies.case import Case
from solidsph.studies.cost import SweepSetup, frontier
from solidsph.studies.frontier import Frontier
from solidsph.studies.frontier_picture import draw_frontier
from solidsph.studies.gallery import write_small_copy
from solidsph.studies.point import Point, format_setting
from solidsph.studies.processes import Processes
from solidsph.studies.search import Goal, search
from solidsph.studies.sweep import SweepStatus
from solidsph.studies.variant import setting_of, with_settings

# Each with the accuracy that is searched for.
CASES: Mapping[str, float] = {
    "csm3": 0.01,
    "csm1": 0.005,
    "cantilever-plate": 0.01,
    "wave-bar": 0.01,
    "sheet-with-hole": 0.01,
    "interpolation": 0.01,
    "falling-edge": 0.01,
}

# Choices changed one at a time from the case's own, as far as it has them.
CHOICES: Mapping[str, Sequence[Any]] = {
    "kernel": tuple(registry.names("kernels")),
    "hourglass": (0.0, 0.1, 0.5, 1.0),
    "time_step_factor": (0.3, 0.5, 0.6, 0.7, 0.8),
}

HEAD = """# What accuracy costs

Error against the reference and wall time, measured together. Written by `make frontiers`; nothing
here is edited by hand. Measured on {day} with {versions}.

A point is on the front if none is both quicker and nearer; dominated points are grey in the
pictures. How near it is says its trusted error: the largest of its scheme at its spacing or any
finer one. What crosses the reference on its way past it is near by chance, and gets no credit.

Times are medians of {repeats} runs, each in a process of its own on a shared machine, building
included: read them as ratios. Compiling is not in them: what it makes is kept on disk.
`solidsph cost CASE` makes the same for any case,
`solidsph cost CASE --accuracy 1%` searches for the cheapest configuration by few runs.
"""

FOOT = """## Our defaults, and what they rest on

Read off this page as it was measured on 2026-12-01:

- **`time_step_factor` 0.6** of the critical step. In CSM3 and the plate factors from 0.3 to 0.8
  change the error by less than 0.001 points, so that a smaller one only costs time. A wave in a bar
  is off by 1.4 % with 0.3 to 0.5, by 1.7 % with 0.6, 2.3 % with 0.7 and 3.1 % with 0.8: where the
  phase of short waves matters, take a smaller one.
- **No hourglass control.** The gradient `consistent` answers for every motion. On beams strengths
  from 0.1 to 1 change the error by 0.05 points at most; in motion they cost a fifth to four fifths
  of the time again. The peak in the sheet, whose nu is 0.49, is off by 0.39 % without, by 0.31 %
  with 0.5.
- **The kernel matters little.** On beams and in the bar five kernels are within 0.1 points of each
  other. In the sheet the Gaussian does best, 0.24 % beside 0.50 % of the cubic spline, and the
  mollifier fails; of those that go well everywhere the cubic spline has the smallest support.
- **The gradient `consistent`** has the nearest points of every front of what bends, waves or is
  pulled. To 1 % `quadratic` is as quick or quicker.
"""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", default=list(CASES), metavar="CASE")
    parser.add_argument("--write", type=Path, help="write the page of the docs to this file")
    parser.add_argument("--repeats", type=int, default=1)
    wanted = parser.parse_args()
    sections = []
    for name in wanted.cases:
        lines = list(section(name, wanted.repeats, wanted.write))
        print("\n".join(lines), flush=True)
        sections += lines
    if wanted.write is not None:
        versions = f"Python {platform.python_version()}, numpy {np.__version__}, "
        head = HEAD.format(
            day=datetime.datetime.now(tz=datetime.UTC).date(),
            versions=versions + f"scipy {scipy.__version__}",
            repeats=wanted.repeats,
        )
        wanted.write.write_text("\n".join([head, *sections, FOOT]), encoding="utf-8")


def section(name: str, repeats: int, page: Path | None) -> Iterator[str]:
    case: Case = registry.load("cases", name)()
    priced = case.priced()
    folder = Path("results/frontiers") / name
    means = SweepSetup(Processes(1), folder, repeats, watch)
    made = frontier(case, None, means)
    own = {axis: setting_of(priced, axis) for axis in priced.sweep}
    default = next(point for point in made.points if point.settings == own)
    yield f"## {priced.title}\n\n`solidsph cost {name}`: {made.sentence()}\n"
    picture = folder / f"{name}.png"
    draw_frontier(made, priced.title, picture)
    if page is not None:
        kept = page.with_suffix("") / picture.name
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_small_copy(picture, kept)
        yield f"![{name}]({kept.parent.name}/{kept.name})\n"
    yield table("The front", made, default)
    yield orders(made)
    excess = made.excess(default)
    yield (
        f"The case's own parameters, {default.label()}: {100.0 * default.error:.2g} % in "
        f"{default.time:.2g} s, {excess:.2g} times the time of what is as near on the front.\n"
    )
    yield one_at_a_time(priced, default, means)
    yield by_search(priced, made, CASES[name])


def table(title: str, made: Frontier, default: Point) -> str:
    columns = (
        *("configuration", "error, %", "trusted, %", "time, s"),
        *("pair evaluations", "memory, MiB"),
    )
    rows = [row(point, default) for point in made.front()]
    trusted = [f"{100.0 * made.trusted(point):.3g}" for point in made.front()]
    cells = tuple((*one[:2], more, *one[2:]) for one, more in zip(rows, trusted, strict=True))
    return "#" + Table(title, columns, cells).markdown()


def row(point: Point, default: Point) -> tuple[str, ...]:
    return (
        point.label() + (" (the case's own)" if point.settings == default.settings else ""),
        f"{100.0 * point.error:.3g}" if point.finished else point.outcome.splitlines()[0],
        f"{point.time:.3g}",
        f"{point.pair_evaluations:.3g}",
        f"{point.peak_memory / 2**20:.0f}",
    )


def orders(made: Frontier) -> str:
    rows = tuple(
        (
            ", ".join(f"{key} {format_setting(value)}" for key, value in one.settings.items()),
            f"{one.in_spacing:.2f}",
            f"{one.in_time:.2f}",
            "no" if one.crosses else "yes",
        )
        for one in sorted(made.orders(), key=lambda one: -one.in_spacing)
    )
    columns = ("scheme", "order in spacing", "in time", "falls at every refinement")
    return "#" + Table("Orders", columns, rows).markdown()


def one_at_a_time(case: Case, default: Point, means: SweepSetup) -> str:
    """The case's own parameters with one choice changed."""
    rows = []
    for choice, values in CHOICES.items():
        try:
            chosen = setting_of(case, choice)
        except SceneError:  # a case without scenes
            continue
        changed = [value for value in values if _can_be(case, choice, value)]
        points = means.points(case, [{choice: value} for value in changed])
        for value, point in zip(changed, points, strict=True):
            mark = " (own)" if chosen == value else ""
            rows.append((f"{choice} {format_setting(value)}{mark}", *row(point, default)[1:3]))
    columns = ("one choice changed", "error, %", "time, s")
    return "#" + Table("One choice at a time", columns, tuple(rows)).markdown()


def _can_be(case: Case, choice: str, value: Any) -> bool:
    """Whether scenes of the case, if it has any, can be built with a choice: one at rest has no
    step."""
    scene = next(iter(with_settings(case, {choice: value}).scenes().values()), None)
    if scene is None:
        return True
    try:
        Simulation.builder(scene).build()
    except BuildError:
        return False
    return True


def by_search(case: Case, made: Frontier, accuracy: float) -> str:
    """What the search finds on the same points, and what it spends, beside the whole grid."""
    known = {repr(sorted(point.settings.items())): point for point in made.points}

    def run(settings: Mapping[str, Any]) -> Point:
        return (
            known.get(repr(sorted(settings.items())))
            or SweepSetup(folder=Path("results/frontiers/beyond")).points(case, [settings])[0]
        )

    found = search(case, case.sweep, Goal(error=accuracy), run)
    cheapest = made.cheapest(accuracy)
    grid, spent = (
        sum(point.time for point in points if isfinite(point.time))
        for points in (made.points, found.tried)
    )
    if found.point is None:
        return f"A search for {100.0 * accuracy:g} % finds nothing: {found.sure}.\n"
    beside = (
        "where the grid has nothing"
        if cheapest is None
        else f"{found.point.time / cheapest.time:.2g} times the time of the grid's cheapest"
    )
    return (
        f"A search for {100.0 * accuracy:g} % finds {found.point.label()}: "
        f"{100.0 * found.point.error:.2g} % in {found.point.time:.2g} s, {beside}, with "
        f"{100.0 * spent / grid:.0f} % of the run time of the grid. {found.sure}.\n"
    )


def watch(standing: SweepStatus) -> None:
    if standing.point is not None:
        print(
            f"{standing.remaining} left: {standing.point.label()}: "
            f"{100.0 * standing.point.error:.3g} % in {standing.point.time:.3g} s",
            file=sys.stderr,
            flush=True,
        )


if __name__ == "__main__":
    main()
