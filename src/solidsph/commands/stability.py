"""solidsph stability: hard cases and their outcomes; or a map of where schemes are stable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import attrs
import click

from solidsph.commands.console import Table, present, progress
from solidsph.commands.options import (
    Output,
    flag,
    option,
    option_group,
    options,
    output_option,
)
from solidsph.commands.scheme_options import SchemeOptions
from solidsph.commands.target import STANDARD_INPUT
from solidsph.errors import SceneError
from solidsph.studies.suite import Verdict, run_trial, trials


@attrs.frozen
class _Options(Output):
    listed: bool = flag("List the trials without running them.", "--list")
    brief: bool = flag("Run the short form of each trial.")
    map: bool = flag("Draw a stability map of a scheme instead.")
    scheme: SchemeOptions = option_group(SchemeOptions)
    points: tuple[int, int] = option(
        "Number of stretches and of covers in the map.",
        type=(int, int),
        default=(39, 22),
        show_default=True,
        metavar="S C",
    )
    output: Path = output_option("Folder for the picture.", Path("results/stability"))


@click.command()
@click.argument("cases", metavar="[CASE]...", nargs=-1)
@options(_Options)
def stability(cases: tuple[str, ...], options: _Options) -> None:
    """Run the hard cases, or draw a stability map.

    All cases or those named run with their own scheme, or with the parts given. Some trials must
    fail: a suite in which nothing can fail proves nothing.
    """
    for name in cases:
        if name == STANDARD_INPUT or name.endswith(".toml"):
            raise SceneError(
                f"stability runs cases, and {name!r} is a scene; look for failure in it with: "
                f"solidsph run {name} --watch"
            )
    if options.map:
        if cases:
            raise SceneError(f"a map is of a scheme, not of cases; leave out {', '.join(cases)}")
        from solidsph.commands.stability_map import draw_map

        picture = options.output / "map.png"
        draw_map(options.scheme, options.points, picture, as_json=options.as_json)
    elif options.listed:
        _list(cases, as_json=options.as_json)
    else:
        _run(cases, _settings(options.scheme), options)


def _list(cases: Sequence[str], *, as_json: bool) -> None:
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


def _run(cases: Sequence[str], settings: Mapping[str, Any], options: _Options) -> None:
    from solidsph.studies.suite_picture import draw_suite

    wanted = list(trials(cases))
    verdicts = []
    with progress(options.progress) as display, TemporaryDirectory() as folder:
        task = display.add_task("hard cases", total=len(wanted)) if display else None
        for number, (name, label, case, trial) in enumerate(wanted):
            if display is not None and task is not None:
                display.update(task, description=f"{name}: {label}", completed=number)
            place = Path(folder) / str(number)
            verdicts.append(
                run_trial(name, label, case, trial, place, settings=settings, brief=options.brief)
            )
    picture = options.output / "suite.png"
    changes = ", ".join(f"{name} {value}" for name, value in settings.items())
    title = f"Hard cases: {changes}" if changes else "Hard cases"
    draw_suite(verdicts, title, picture)
    facts = {
        "trials": [_facts(verdict) for verdict in verdicts],
        "wall time [s]": sum(verdict.seconds for verdict in verdicts),
        "picture": str(picture),
    }
    passed = all(verdict.as_expected for verdict in verdicts)
    present(facts, _text(title, verdicts, facts), as_json=options.as_json, passed=passed)


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
    keys = ("case", "trial", "grade", "as expected", "time [s]", "energy residual", "why")
    yield Table.of(title, rows, keys, {"grade": "outcome"})
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
