"""solidsph check: whether a part keeps its interface's promises, and what a scheme does."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click

from solidsph.commands.console import say, show_json, show_table
from solidsph.commands.scheme_options import (
    SchemeOptions,
    confirmations,
    facts,
    passed,
    scheme_options,
    show_certificate,
    stretch_of,
)
from solidsph.commands.target import parameters
from solidsph.errors import SceneError
from solidsph.registry import registry

if TYPE_CHECKING:
    from solidsph.promises.check import CheckResult


@click.command()
@click.argument("name", metavar="[PLUGIN]", required=False)
@click.option("--all", "everything", is_flag=True, help="Every installed part, or all of a kind.")
@click.option("--kind", help="Kind of part, where parts of several kinds have the name.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A part's parameter.")
@scheme_options
@click.option("--stretch", default="1", show_default=True, help="Of a scheme: 1.2, or 1.2,1,1.")
@click.option("--dimension", type=click.IntRange(1, 3), help="Of a scheme.  [default: 2]")
@click.option("--run", "confirm", is_flag=True, help="Confirm a scheme's certificate by runs.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table.")
def check(
    name: str | None,
    everything: bool,
    kind: str | None,
    settings: tuple[str, ...],
    stretch: str,
    dimension: int | None,
    confirm: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Certify a part by name: the conformance kit that every built-in part passes. Or a scheme, by
    the waves of its lattice: zero-energy and growing ones, critical step, wave speeds."""
    scheme = SchemeOptions(**options)
    if everything:
        if name is not None or scheme.given:
            raise SceneError("--all checks every part; leave out the name and the scheme's options")
        _conform_all(kind, as_json)
        return
    if name is None:
        if not scheme.given and dimension is None and stretch == "1":
            raise SceneError(
                "there is nothing to check; name a part, such as `solidsph check cubic-spline`, "
                "all of them with --all, or a scheme, such as `solidsph check --scheme SCENE` or "
                "`--kernel NAME --cover 3`"
            )
        _certify(scheme, settings, stretch, dimension or 2, confirm, as_json)
        return
    if scheme.given or dimension is not None:
        raise SceneError(
            f"{name!r} is a part, but the options name a scheme; check one at a time: leave out "
            "the part's name, or the scheme's options"
        )
    _conform(name, kind, settings, as_json)


def _certify(
    options: SchemeOptions,
    settings: tuple[str, ...],
    stretch: str,
    dimension: int,
    confirm: bool,
    as_json: bool,
) -> None:
    from solidsph.studies.certificate import certificate

    found = certificate(options.made(settings), dimension, stretch_of(stretch))
    confirmed = confirmations(found) if confirm else []
    good = passed(found) and not any(row[1] == "FAIL" for row in confirmed)
    if as_json:
        show_json({**facts(found), "confirmed": confirmed})
    else:
        show_certificate(found, confirmed)
        say("certified" if good else "NOT certified: see FAIL above")
    if not good:
        raise SystemExit(1)


def _conform(name: str, kind: str | None, settings: tuple[str, ...], as_json: bool) -> None:
    from solidsph.testing import conformance, example_part, kits

    found = _kind_of(name, kind)
    if found not in kits():
        raise SceneError(
            f"there is no conformance kit for a {registry.singular(found)}; kits exist for "
            f"{', '.join(registry.singular(one) for one in kits())}"
        )
    try:
        part = example_part(found, name, **parameters(settings))
    except SceneError as cause:
        missing = re.search(r"missing parameter '(\w+)'", str(cause))
        if missing is None:
            raise
        raise SceneError(f"{cause}, such as --set {missing[1]}=1.0") from None
    entry = registry.find(found, name)
    results = conformance(found, part)
    good = all(result.passed for result in results)
    if as_json:
        show_json(
            {
                "part": name,
                "kind": registry.singular(found),
                "distribution": f"{entry.distribution} {entry.version}",
                "passed": good,
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
        )
    else:
        show_table(
            f"{registry.singular(found)} {name} ({entry.distribution} {entry.version}): {part}",
            ["check", "", "measured", "required"],
            [[r.name, _verdict(r), r.measured, r.required] for r in results],
        )
        count = sum(not result.passed for result in results)
        say("certified" if good else f"NOT certified: {count} of {len(results)} checks failed")
        left = [result.name for result in results if not result.checked]
        if left:
            say(f"not checked, since it does not promise them: {', '.join(left)}")
    if not good:
        raise SystemExit(1)


def _verdict(result: CheckResult) -> str:
    if not result.checked:
        return "not checked"
    return "pass" if result.passed else "FAIL"


def _conform_all(kind: str | None, as_json: bool) -> None:
    """A badge for every part: how many of its checks it passes."""
    from solidsph.testing import conformance, example_part, kits

    rows: list[dict[str, Any]] = []
    for one in kits() if kind is None else [_kind(kind)]:
        for name in registry.names(one):
            entry = registry.find(one, name)
            results = conformance(one, example_part(one, name))
            failed = [result.name for result in results if not result.passed]
            rows.append(
                {
                    "kind": registry.singular(one),
                    "part": name,
                    "distribution": f"{entry.distribution} {entry.version}",
                    "passed": sum(result.passed and result.checked for result in results),
                    "checks": sum(result.checked for result in results),
                    "failed": failed,
                }
            )
    good = not any(row["failed"] for row in rows)
    if as_json:
        show_json({"passed": good, "parts": rows})
    else:
        show_table(
            "conformance",
            ["kind", "part", "distribution", "", "checks", "failed"],
            [
                [
                    row["kind"],
                    row["part"],
                    row["distribution"],
                    "FAIL" if row["failed"] else "pass",
                    f"{row['passed']} of {row['checks']}",
                    ", ".join(row["failed"]),
                ]
                for row in rows
            ],
        )
        say("all certified" if good else "NOT all certified")
    if not good:
        raise SystemExit(1)


def _kind(word: str) -> str:
    """A kind that has a kit, from its name or that of one part."""
    from solidsph.testing import kits

    found = [one for one in kits() if word in (one, registry.singular(one))]
    if not found:
        known = ", ".join(registry.singular(one) for one in kits())
        raise SceneError(f"unknown kind {word!r}; kinds with a kit: {known}")
    return found[0]


def _kind_of(name: str, kind: str | None) -> str:
    kinds = [one for one in registry.INTERFACES if name in registry.names(one)]
    if kind is not None:
        wanted = [one for one in registry.INTERFACES if kind in (one, registry.singular(one))]
        if not wanted:
            known = ", ".join(registry.singular(one) for one in registry.INTERFACES)
            raise SceneError(f"unknown kind {kind!r}; known: {known}")
        registry.find(wanted[0], name)
        return wanted[0]
    if len(kinds) > 1:
        listed = ", ".join(registry.singular(one) for one in kinds)
        raise SceneError(f"{name!r} names parts of several kinds: {listed}; choose with --kind")
    if not kinds:
        everything = [known for one in registry.INTERFACES for known in registry.names(one)]
        import difflib

        near = difflib.get_close_matches(name, everything, 1)
        hint = f"did you mean {near[0]!r}?" if near else "list them: solidsph plugins"
        raise SceneError(f"no installed part is called {name!r}; {hint}")
    return kinds[0]
