"""solidsph stability: hard cases and their outcomes; or a map of where schemes are stable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from solidsph.commands.console import Table, present, progress
from solidsph.commands.options import json_option, output_option, quiet_option
from solidsph.commands.scheme_options import SchemeOptions, scheme_options
from solidsph.errors import SceneError

if TYPE_CHECKING:
    from solidsph.studies.suite import Verdict


@click.command()
@click.argument("cases", metavar="[CASE]...", nargs=-1)
@click.option("--list", "listed", is_flag=True, help="List the trials without running them.")
@click.option("--brief", is_flag=True, help="Run the short form of each trial.")
@click.option("--map", "as_map", is_flag=True, help="Draw a stability map of a scheme instead.")
@scheme_options
@click.option(
    "--points",
    type=(int, int),
    default=(39, 22),
    show_default=True,
    metavar="S C",
    help="Number of stretches and of covers in the map.",
)
@output_option("Folder for the picture.", "results/stability")
@json_option
@quiet_option
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
    """Run the hard cases, all or those named, with their own scheme or with the parts given, and
    report the outcome of each trial. Some must fail: a suite in which nothing can fail proves
    nothing."""
    scheme = SchemeOptions(**options)
    if as_map:
        if cases:
            raise SceneError(f"a map is of a scheme, not of cases; leave out {', '.join(cases)}")
        from solidsph.commands.stability_map import draw_map

        draw_map(scheme, points, output / "map.png", as_json=as_json)
    elif listed:
        _list(cases, as_json=as_json)
    else:
        _run(cases, _settings(scheme), output, brief=brief, as_json=as_json, quiet=quiet)


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
    table = Table.of("hard cases", rows, ("case", "trial", "expected", "why"))
    present({"trials": rows}, [table], as_json=as_json)


def _run(
    cases: Sequence[str],
    settings: Mapping[str, Any],
    output: Path,
    *,
    brief: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    from solidsph.studies.suite import run_trial, trials
    from solidsph.studies.suite_picture import draw_suite

    wanted = list(trials(cases))
    verdicts = []
    with progress(not (as_json or quiet)) as display, TemporaryDirectory() as folder:
        task = display.add_task("hard cases", total=len(wanted)) if display else None
        for number, (name, label, case, trial) in enumerate(wanted):
            if display is not None and task is not None:
                display.update(task, description=f"{name}: {label}", completed=number)
            place = Path(folder) / str(number)
            verdicts.append(
                run_trial(name, label, case, trial, place, settings=settings, brief=brief)
            )
    picture = output / "suite.png"
    changes = ", ".join(f"{name} {value}" for name, value in settings.items())
    title = f"Hard cases: {changes}" if changes else "Hard cases"
    draw_suite(verdicts, title, picture)
    facts = {
        "trials": [_facts(verdict) for verdict in verdicts],
        "wall time [s]": sum(verdict.seconds for verdict in verdicts),
        "picture": str(picture),
    }
    passed = all(verdict.as_expected for verdict in verdicts)
    present(facts, _text(title, verdicts, facts), as_json=as_json, passed=passed)


def _settings(options: SchemeOptions) -> dict[str, Any]:
    """What the options change in the scenes of the hard cases."""
    if options.scheme is not None or options.material is not None or options.effect:
        raise SceneError(
            "hard cases have scenes, materials and effects of their own; change their kernel, "
            "cover, gradient, divergence, formulation or hourglass strength"
        )
    names = ("kernel", "cover", "formulation", "gradient", "divergence", "hourglass")
    return {name: value for name in names if (value := getattr(options, name)) is not None}


def _facts(verdict: Verdict) -> dict[str, Any]:
    return {
        "case": verdict.case,
        "trial": verdict.trial,
        "grade": verdict.grade.value,
        "as expected": verdict.as_expected,
        "reason": verdict.reason,
        "must fail": verdict.must_fail,
        "known": verdict.known,
        "time [s]": verdict.seconds,
        "energy residual": verdict.energy_residual,
    }


def _text(
    title: str, verdicts: Sequence[Verdict], facts: Mapping[str, Any]
) -> Iterator[Table | str]:
    rows = [{**row, "why": _why(v)} for row, v in zip(facts["trials"], verdicts, strict=True)]
    columns = {
        **{"case": "case", "trial": "trial", "outcome": "grade", "as expected": "as expected"},
        **{"time [s]": "time [s]", "energy residual": "energy residual", "why": "why"},
    }
    yield Table.of(title, rows, columns)
    yield f"picture: {facts['picture']}"
    yield f"{len(verdicts)} trials in {facts['wall time [s]']:.0f} s"
    surprises = [v for v in verdicts if not v.as_expected]
    listed = "; ".join(f"{v.case}, {v.trial}: {v.grade.value}" for v in surprises)
    expected = "as expected, including the trials that must fail"
    yield f"verdict: {listed}: NOT as expected" if surprises else f"verdict: {expected}"


def _why(verdict: Verdict) -> str:
    if verdict.must_fail:
        return f"{verdict.reason}; it must fail: {verdict.must_fail}"
    return f"{verdict.reason}; known: {verdict.known}" if verdict.known else verdict.reason
