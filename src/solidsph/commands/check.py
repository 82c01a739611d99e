"""solidsph check: conformance of a part with its interface, or the certificate of a scheme."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs
import click

from solidsph.commands import certificate_tables as tables
from solidsph.commands.console import Table, present
from solidsph.commands.options import Output, flag, option, option_group, options, set_option
from solidsph.commands.scheme_options import SchemeOptions
from solidsph.commands.target import parameters
from solidsph.conformance.check import CheckResult
from solidsph.errors import SceneError
from solidsph.registry import registry
from solidsph.studies.certificate import certificate


@attrs.frozen
class _Options(Output):
    all: bool = flag("Check every installed part, or all of a kind.")
    kind: str | None = option("Kind of the part, where several kinds have the name.")
    settings: tuple[str, ...] = set_option("the part, or of the case of the scheme")
    scheme: SchemeOptions = option_group(SchemeOptions)
    stretch: str = option(
        "Stretch of the lattice of a scheme: 1.2, or by axis 1.2,1,1.",
        default="1",
        show_default=True,
    )
    dimension: int | None = option(
        "Dimension of that lattice.  [default: 2]", type=click.IntRange(1, 3)
    )
    run: bool = flag("Confirm a scheme's certificate by runs.")


@click.command()
@click.argument("name", metavar="[PART]", required=False)
@options(_Options)
def check(name: str | None, options: _Options) -> None:
    """Check a part, or certify a scheme.

    A part is checked by the conformance kit of its kind. A scheme is certified by the waves on its
    lattice: zero-energy and growing waves, critical step, wave speeds.
    """
    if options.all:
        if name is not None or options.scheme.given:
            raise SceneError("--all checks every part; leave out the name and the scheme's options")
        _check_all(options)
    elif name is not None:
        if options.scheme.given or options.dimension is not None:
            raise SceneError(
                f"{name!r} is a part, but the options name a scheme; check one at a time: leave "
                "out the part's name, or the scheme's options"
            )
        _check_part(name, options)
    elif options.scheme.given or options.dimension is not None or options.stretch != "1":
        _certify(options)
    else:
        raise SceneError(
            "there is nothing to check; name a part, such as `solidsph check cubic-spline`, "
            "all of them with --all, or a scheme, such as `solidsph check --scheme SCENE` or "
            "`--kernel NAME --cover 3`"
        )


def _certify(options: _Options) -> None:
    stretch = _stretch(options.stretch)
    result = certificate(options.scheme.build(options.settings), options.dimension or 2, stretch)
    confirmed = tables.confirmations(result) if options.run else []
    good = tables.passed(result) and not any(row[1] == "FAIL" for row in confirmed)
    present(
        {**tables.certificate_facts(result), "confirmed": confirmed},
        (
            *tables.certificate_text(result, confirmed),
            "certified" if good else "NOT certified: see FAIL above",
        ),
        as_json=options.as_json,
        passed=good,
    )


def _stretch(text: str) -> float | list[float]:
    """Stretch of all axes, or of each, from "1.2" or "1.2,1"."""
    try:
        stretches = [float(number) for number in text.split(",")]
    except ValueError:
        raise SceneError(
            f'--stretch {text!r} is no number; give "1.2", or "1.2,1" by axis'
        ) from None
    return stretches[0] if len(stretches) == 1 else stretches


def _check_part(name: str, options: _Options) -> None:
    from solidsph.testing import conformance, example_part, kits

    group = _group_of(name, options.kind)
    if group not in kits():
        raise SceneError(
            f"there is no conformance kit for a {registry.singular(group)}; kits exist for "
            f"{_listed(kits())}"
        )
    part = example_part(group, name, **parameters(options.settings))
    results = conformance(group, part)
    facts: dict[str, Any] = {
        "part": name,
        "kind": registry.singular(group),
        "distribution": _distribution(group, name),
        "passed": all(result.passed for result in results),
        "checks": [
            {
                "check": result.name,
                "passed": result.passed,
                "checked": result.checked,
                "measured": result.measured,
                "required": result.required,
            }
            for result in results
        ],
    }
    text = _part_text(facts, part, results)
    present(facts, text, as_json=options.as_json, passed=facts["passed"])


def _part_text(
    facts: Mapping[str, Any], part: object, results: Sequence[CheckResult]
) -> Iterator[Table | str]:
    yield Table(
        f"{facts['kind']} {facts['part']} ({facts['distribution']}): {part}",
        ["check", "", "measured", "required"],
        [[r.name, _verdict(r), r.measured, r.required] for r in results],
    )
    failed = sum(not result.passed for result in results)
    yield f"NOT certified: {failed} of {len(results)} checks failed" if failed else "certified"
    skipped = [result.name for result in results if not result.checked]
    if skipped:
        yield f"not checked, because the part does not promise them: {', '.join(skipped)}"


def _verdict(result: CheckResult) -> str:
    if not result.checked:
        return "not checked"
    return "pass" if result.passed else "FAIL"


def _check_all(options: _Options) -> None:
    """How many of its checks every part passes."""
    from solidsph.testing import conformance, example_part, kits

    rows: list[dict[str, Any]] = []
    groups = kits()
    if options.kind is not None:
        groups = (_group(options.kind, groups, "kinds with a kit"),)
    for group in groups:
        for name in registry.names(group):
            results = conformance(group, example_part(group, name))
            rows.append(
                {
                    "kind": registry.singular(group),
                    "part": name,
                    "distribution": _distribution(group, name),
                    "passed": sum(result.passed and result.checked for result in results),
                    "checks": sum(result.checked for result in results),
                    "failed": [result.name for result in results if not result.passed],
                }
            )
    good = not any(row["failed"] for row in rows)
    table = Table(
        "conformance",
        ["kind", "part", "distribution", "", "checks", "failed"],
        [
            [
                *(row["kind"], row["part"], row["distribution"]),
                "FAIL" if row["failed"] else "pass",
                f"{row['passed']} of {row['checks']}",
                ", ".join(row["failed"]),
            ]
            for row in rows
        ],
    )
    verdict = "all certified" if good else "NOT all certified"
    present({"passed": good, "parts": rows}, [table, verdict], as_json=options.as_json, passed=good)


def _distribution(group: str, name: str) -> str:
    entry = registry.find(group, name)
    return f"{entry.distribution} {entry.version}"


def _listed(groups: Sequence[str]) -> str:
    return ", ".join(registry.singular(group) for group in groups)


def _group(kind: str, groups: Sequence[str], known: str = "known") -> str:
    """The group of parts of a kind, which is called by its name or that of one part."""
    for group in groups:
        if kind in (group, registry.singular(group)):
            return group
    raise SceneError(f"unknown kind {kind!r}; {known}: {_listed(groups)}")


def _group_of(name: str, kind: str | None) -> str:
    """The group that a part belongs to."""
    everything = list(registry.INTERFACES)
    if kind is not None:
        group = _group(kind, everything)
        registry.find(group, name)
        return group
    groups = [group for group in everything if name in registry.names(group)]
    if len(groups) > 1:
        raise SceneError(
            f"{name!r} names parts of several kinds: {_listed(groups)}; choose with --kind"
        )
    if not groups:
        known = [part for group in everything for part in registry.names(group)]
        near = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean {near[0]!r}?" if near else "list them: solidsph plugins"
        raise SceneError(f"no installed part is called {name!r}; {hint}")
    return groups[0]
