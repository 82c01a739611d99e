"""solidsph stability: hard cases and what becomes of them; or a map of where schemes are stable."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from solidsph.commands.console import progress, say, show_json, show_table
from solidsph.commands.scheme_options import SchemeOptions, scheme_options
from solidsph.errors import SceneError

if TYPE_CHECKING:
    from solidsph.studies.suite import Verdict


@click.command()
@click.argument("cases", metavar="[CASE]...", nargs=-1)
@click.option("--list", "listed", is_flag=True, help="List the trials, and run none.")
@click.option("--brief", is_flag=True, help="Run the short form of each trial.")
@click.option("--map", "as_map", is_flag=True, help="Draw a map of stability instead.")
@scheme_options
@click.option(
    "--points",
    type=(int, int),
    default=(39, 22),
    show_default=True,
    metavar="S C",
    help="Of the map: how many stretches and covers.",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("results/stability"),
    show_default=True,
    help="Folder for the picture.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table.")
@click.option("--quiet", is_flag=True, help="Show no progress.")
def stability(
    cases: tuple[str, ...],
    listed: bool,
    brief: bool,
    as_map: bool,
    points: tuple[int, int],
    output: Path,
    as_json: bool,
    quiet: bool,
    **options: Any,
) -> None:
    """Run the hard cases, all or those named, by the default parts or by those that are named, and
    say what became of each. Some must fail: a suite in which nothing can fail proves nothing."""
    chosen = SchemeOptions(**options)
    if as_map:
        if cases:
            raise SceneError(f"a map is of a scheme, not of cases; leave out {', '.join(cases)}")
        from solidsph.commands.stability_map import draw_map

        draw_map(chosen, points, output / "map.png", as_json=as_json)
    elif listed:
        _list(cases, as_json=as_json)
    else:
        _run(cases, chosen, output, brief=brief, as_json=as_json, quiet=quiet)


def _run(
    cases: Sequence[str],
    chosen: SchemeOptions,
    output: Path,
    *,
    brief: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    from solidsph.studies.suite import run_trial, trials
    from solidsph.studies.suite_picture import draw_suite

    words = _words(chosen)
    wanted = list(trials(cases))
    verdicts = []
    with progress(not (as_json or quiet)) as display, TemporaryDirectory() as folder:
        task = display.add_task("hard cases", total=len(wanted)) if display else None
        for number, (name, label, case, trial) in enumerate(wanted):
            if display is not None and task is not None:
                display.update(task, description=f"{name}: {label}", completed=number)
            place = Path(folder) / str(number)
            verdicts.append(run_trial(name, label, case, trial, place, words=words, brief=brief))
    picture = output / "suite.png"
    title = "Hard cases" + (f": {', '.join(f'{k} {v}' for k, v in words.items())}" if words else "")
    draw_suite(verdicts, title, picture)
    surprises = [one for one in verdicts if not one.as_expected]
    seconds = sum(one.seconds for one in verdicts)
    if as_json:
        rows = [_facts(one) for one in verdicts]
        show_json({"trials": rows, "wall time [s]": seconds, "picture": str(picture)})
    else:
        show_table(
            title,
            ["case", "trial", "became", "as expected", "time [s]", "energy residual", "why"],
            [
                [
                    *(one.case, one.trial, one.grade.value, one.as_expected, one.seconds),
                    *(one.energy_residual, _why(one)),
                ]
                for one in verdicts
            ],
        )
        say(f"picture: {picture}")
        say(f"{len(verdicts)} trials in {seconds:.0f} s")
        say(
            "verdict: "
            + (
                "; ".join(f"{one.case}, {one.trial}: {one.grade.value}" for one in surprises)
                + ": NOT as expected"
                if surprises
                else "as expected, those that must fail included"
            )
        )
    if surprises:
        raise SystemExit(1)


def _words(chosen: SchemeOptions) -> dict[str, Any]:
    if chosen.scheme is not None or chosen.material is not None or chosen.effect:
        raise SceneError(
            "hard cases have scenes, materials and effects of their own; change their kernel, "
            "cover, gradient, divergence, formulation or hourglass strength"
        )
    names = ("kernel", "cover", "formulation", "gradient", "divergence", "hourglass")
    return {name: value for name in names if (value := getattr(chosen, name)) is not None}


def _why(one: Verdict) -> str:
    reason = one.reason
    if one.must_fail:
        return f"{reason}; it must fail: {one.must_fail}"
    return f"{reason}; known: {one.known}" if one.known else reason


def _facts(one: Verdict) -> dict[str, Any]:
    return {
        "case": one.case,
        "trial": one.trial,
        "grade": one.grade.value,
        "as expected": one.as_expected,
        "reason": one.reason,
        "must fail": one.must_fail,
        "known": one.known,
        "time [s]": one.seconds,
        "energy residual": one.energy_residual,
    }


def _list(cases: Sequence[str], *, as_json: bool) -> None:
    from solidsph.studies.suite import trials

    rows = [
        {
            "case": name,
            "trial": label,
            "expected": "fails"
            if trial.must_fail
            else "does not come through"
            if trial.known
            else "stable",
            "why": trial.must_fail or trial.known or case.source,
        }
        for name, label, case, trial in trials(cases)
    ]
    if as_json:
        show_json({"trials": rows})
        return
    show_table(
        "hard cases", ["case", "trial", "expected", "why"], [list(row.values()) for row in rows]
    )
